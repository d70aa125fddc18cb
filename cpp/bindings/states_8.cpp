// The models of the registry whose state has 8 numbers, compiled.
#include "desk/states.hpp"

namespace auvest {
namespace desk {

template void add_models<8, float>(Catalogue<float>&);
template void add_models<8, double>(Catalogue<double>&);

}  // namespace desk
}  // namespace auvest
