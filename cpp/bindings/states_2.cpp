// The models of the registry whose state has 2 numbers, compiled.
#include "desk/states.hpp"

namespace auvest {
namespace desk {

template void add_models<2, float>(Catalogue<float>&);
template void add_models<2, double>(Catalogue<double>&);

}  // namespace desk
}  // namespace auvest
