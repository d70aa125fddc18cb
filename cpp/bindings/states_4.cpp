// The models of the registry whose state has 4 numbers, compiled.
#include "desk/states.hpp"

namespace auvest {
namespace desk {

template void add_models<4, float>(Catalogue<float>&);
template void add_models<4, double>(Catalogue<double>&);

}  // namespace desk
}  // namespace auvest
