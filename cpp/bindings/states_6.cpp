// The models of the registry whose state has 6 numbers, compiled.
#include "desk/states.hpp"

namespace auvest {
namespace desk {

template void add_models<6, float>(Catalogue<float>&);
template void add_models<6, double>(Catalogue<double>&);

}  // namespace desk
}  // namespace auvest
