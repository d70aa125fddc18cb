// The models of my_models.hpp in filters, beside the library's own: the same bits over 10,000
// steps, through the station's near field too.
#include "my_models.hpp"

#include <cstdio>
#include <cstring>

namespace {

using auvest::Status;

template <class Mine, class Built, class MySensor, class BuiltSensor>
bool same_bits(const char* name) {
  using Scalar = typename Mine::Scalar;
  Mine mine{MyAcceleration<Scalar>()};
  Built built{auvest::ExactAcceleration<Scalar>()};
  const MySensor my_sensor;
  const BuiltSensor sensor;
  typename Mine::State x0, truth;
  x0 << 9, 1, 0, 0, 0, 0;
  truth << 10, 2, 0, 0, 0, 0;
  const typename Mine::Covariance P0 = Mine::Covariance::Identity();
  if (mine.reset(x0, P0) != Status::kOk || built.reset(x0, P0) != Status::kOk) return false;

  auvest::math::Random random(1);
  int near = 0;
  for (int k = 0; k < 10000; ++k) {
    // An ellipse around the station that comes close to it.
    const Scalar turn = Scalar(0.01) * Scalar(k);
    Scalar s, c;
    auvest::math::sincos(auvest::math::wrap(turn), s, c);
    truth(0) = Scalar(0.2) + Scalar(10) * c;
    truth(1) = Scalar(2) + Scalar(0.05) * s;
    auto z = sensor.h(truth);
    z(0) = auvest::math::absolute(z(0) + Scalar(0.05) * random.normal<Scalar>());
    z(1) = auvest::math::wrap(z(1) + Scalar(0.01) * random.normal<Scalar>());
    if (mine.predict(Scalar(0.1)) != Status::kOk) return false;
    if (built.predict(Scalar(0.1)) != Status::kOk) return false;
    const auto correction = mine.update(z, my_sensor);
    if (correction.status != Status::kOk) return false;
    if (built.update(z, sensor).status != Status::kOk) return false;
    near += correction.near_field ? 1 : 0;
    const auto p = mine.P();
    const auto q = built.P();
    if (std::memcmp(mine.x().data(), built.x().data(), sizeof mine.x()) != 0 ||
        std::memcmp(p.data(), q.data(), sizeof p) != 0) {
      std::fprintf(stderr, "%s: other bits at step %d\n", name, k);
      return false;
    }
  }
  std::printf("%s: the same bits over 10,000 steps, %d of them near the station\n", name, near);
  return near > 0;
}

template <class Scalar>
bool same_bits_in(const char* ekf, const char* ukf) {
  using Mine = MyAcceleration<Scalar>;
  using Built = auvest::ExactAcceleration<Scalar>;
  using MySensor = MyRangeBearing<Scalar, 6>;
  using Sensor = auvest::RangeBearing<Scalar, 6>;
  return same_bits<auvest::Ekf<Mine>, auvest::Ekf<Built>, MySensor, Sensor>(ekf) &&
         same_bits<auvest::Ukf<Mine>, auvest::Ukf<Built>, MySensor, Sensor>(ukf);
}

}  // namespace

int main() {
  return same_bits_in<float>("Ekf, float", "Ukf, float") &&
                 same_bits_in<double>("Ekf, double", "Ukf, double")
             ? 0
             : 1;
}
