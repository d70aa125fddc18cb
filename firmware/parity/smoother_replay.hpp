// Replays a record through a fixed lag: the robust EKF of speed and heading, ranges to leaders, and
// what it knows 12 predictions later. Another program that `main` may be built around (see
// replay.hpp), with the same streams; tests/parity/test_smoother.py writes the record.
//
//     record: steps, x0, P0, then per step: measured?, dt, input, z, leader
//     trace:  status of reset, then per step: statuses, predictions back, x, P then and now
#pragma once

#include "auvest/filters/robust_ekf.hpp"
#include "auvest/filters/smoother.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/speed_heading.hpp"

namespace auvest {
namespace parity {

const int kLag = 12;

template <class Stream>
class SmootherReplay {
 public:
  explicit SmootherReplay(Stream& stream) : stream_(stream) {}

  void run() {
    const std::uint32_t steps = stream_.read();
    Vector<float, 2> x0;
    Matrix<float, 2, 2> p0;
    for (int i = 0; i < 2; ++i) x0(i) = read();
    for (int i = 0; i < 4; ++i) p0.data()[i] = read();
    write(smoother_.reset(x0, p0));
    for (std::uint32_t k = 0; k < steps; ++k) step();
  }

 private:
  using Filter = RobustEkf<SpeedHeading<float>>;

  void step() {
    const bool measured = stream_.read() != 0;
    const float dt = read();
    Vector<float, 3> input;
    for (int i = 0; i < 3; ++i) input(i) = read();
    Vector<float, 1> z;
    z(0) = read();
    LeaderRange<float, 2> range;
    range.params.leader_x_m = read();
    range.params.leader_y_m = read();

    write(smoother_.predict(dt, input));
    write(measured ? smoother_.update(z, range).status : Status::kOk);
    stream_.write(static_cast<std::uint32_t>(smoother_.lag()));
    write(smoother_.lagged());
    write(smoother_.smoothed(0));
  }

  float read() { return math::from_bits(stream_.read()); }
  void write(Status status) { stream_.write(static_cast<std::uint32_t>(status)); }
  void write(const Belief<float, 2>& belief) {
    for (int i = 0; i < 2; ++i) stream_.write(math::to_bits(belief.x(i)));
    for (int i = 0; i < 4; ++i) stream_.write(math::to_bits(belief.P.data()[i]));
  }

  Stream& stream_;
  FixedLagSmoother<Filter, kLag> smoother_;
};

/// Reads one record from the stream and writes its trace.
template <class Stream>
void replay(Stream& stream) {
  SmootherReplay<Stream>(stream).run();
}

}  // namespace parity
}  // namespace auvest
