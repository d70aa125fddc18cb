// The models of the registry whose state has 3 numbers, compiled.
#include "desk/states.hpp"

namespace auvest {
namespace desk {

template void add_models<3, float>(Catalogue<float>&);
template void add_models<3, double>(Catalogue<double>&);

}  // namespace desk
}  // namespace auvest
