// The models of the registry whose state has 6 numbers, compiled.
#include "auvest/registry.hpp"
#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

AUVEST_DEFINE_MODELS(6)

}  // namespace desk
}  // namespace auvest
