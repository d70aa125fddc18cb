// Every filter in single precision.
#include "every_filter/members.hpp"

namespace every_filter {

std::vector<Member> members_float() { return members<float>(); }

}  // namespace every_filter
