// The models of the registry whose state has 3 numbers, compiled.
#include "auvest/registry.hpp"
#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

AUVEST_DEFINE_MODELS(3)

}  // namespace desk
}  // namespace auvest
