// The models of the registry whose state has 8 numbers, compiled.
#include "auvest/registry.hpp"
#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

AUVEST_DEFINE_MODELS(8)

}  // namespace desk
}  // namespace auvest
