// Every filter in double precision.
#include "every_filter/members.hpp"

namespace every_filter {

std::vector<Member> members_double() { return members<double>(); }

}  // namespace every_filter
