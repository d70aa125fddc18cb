// EkfSlat for Python, with one model of a master and with an Imm, and DeadReckoning.
#include "slatf_setup.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion, class Master>
SlatfInterface<Motion>* make_ekf_slat(const Motion& motion, const Master& master,
                                      const EkfSlatParams<typename Motion::Scalar>& params) {
  using Filter = EkfSlat<Motion, Master, EkfMasters<Master>::kMost>;
  return new GaussianSlatModel<Filter>(Filter(motion, master, params));
}

template <class Motion>
SlatfInterface<Motion>* make_dead_reckoning(const Motion& motion,
                                            typename Motion::Scalar longest_step_s) {
  using Filter = DeadReckoning<Motion>;
  return new GaussianSlatModel<Filter>(Filter(motion, longest_step_s));
}

#define AUVEST_MAKE(Motion)                                                                     \
  template SlatfInterface<Motion>* make_ekf_slat(const Motion&,                                 \
                                                 const PiecewiseAcceleration<Motion::Scalar>&,  \
                                                 const EkfSlatParams<Motion::Scalar>&);         \
  template SlatfInterface<Motion>* make_ekf_slat(                                               \
      const Motion&, const ThreeModels<Motion::Scalar>&, const EkfSlatParams<Motion::Scalar>&); \
  template SlatfInterface<Motion>* make_dead_reckoning(const Motion&, Motion::Scalar);

AUVEST_MAKE(CompassMotion<float>)
AUVEST_MAKE(CompassMotion<double>)
AUVEST_MAKE(UnicycleMotion<float>)
AUVEST_MAKE(UnicycleMotion<double>)

#undef AUVEST_MAKE

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
