// Writes what a slave meets in the scenario of the SLATF paper (simulation/slat.hpp, R1),
// computed in double and rounded to float once: its state and what it was told of the master when
// communication broke, then every reading and echo. firmware/parity/slatf.py reads it.
//
//     slatf_world SEED > FILE
#include <cstdio>
#include <cstdlib>

#include "auvest/math/bits.hpp"
#include "simulation/slat.hpp"

namespace {

/// Takes the place of a filter in run_slat() and writes down what it is given.
class Recorder {
 public:
  using Scalar = float;
  using Control = auvest::Vector<float, 2>;
  using VelocityChange = auvest::Vector<float, 2>;
  using SlaveBelief = auvest::Belief<float, 2>;
  using MasterBelief = auvest::Belief<float, 6>;

  auvest::Status reset(const SlaveBelief& slave, auvest::math::Random&) { return write(slave); }
  auvest::Status add_master(const MasterBelief& master) { return write(master); }

  auvest::Status predict(float dt, const Control& u, auvest::math::Random&,
                         const VelocityChange* changes) {
    if (pending_) finish(nullptr);
    write(dt);
    write(u);
    write(changes[0]);
    pending_ = true;
    return auvest::Status::kOk;
  }

  auvest::Status update(const auvest::Echo<float>* heard, int count, const auvest::Sonar<float>&,
                        auvest::math::Random&) {
    finish(count > 0 ? heard : nullptr);
    return auvest::Status::kOk;
  }

 private:
  void finish(const auvest::Echo<float>* heard) {
    auvest::Vector<float, 2> z;
    auvest::math::set_zero(z);
    put(heard != nullptr ? 1 : 0);
    write(heard != nullptr ? heard->z : z);
    pending_ = false;
  }

  template <int Size>
  auvest::Status write(const auvest::Belief<float, Size>& belief) {
    for (int i = 0; i < Size; ++i) write(belief.x(i));
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) write(belief.P(i, j));
    }
    return auvest::Status::kOk;
  }

  void write(const auvest::Vector<float, 2>& vector) {
    for (int i = 0; i < 2; ++i) write(vector(i));
  }

  void write(float value) { put(auvest::math::to_bits(value)); }

  static void put(std::uint32_t word) {
    for (int i = 0; i < 4; ++i) std::putchar(static_cast<int>(word >> 8 * i & 0xff));
  }

  bool pending_ = false;  // a reading waits for its echo
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: slatf_world SEED\n", stderr);
    return 2;
  }
  auvest::math::Random world(std::strtoull(argv[1], nullptr, 10));
  auvest::math::Random unused(0);
  Recorder recorder;
  const auvest::Status status =
      auvest::run_slat(recorder, auvest::Sonar<float>(), auvest::SlatScenario(), world, unused,
                       [](const auvest::SlatStep<Recorder>&) {});
  return status == auvest::Status::kOk ? 0 : 1;
}
