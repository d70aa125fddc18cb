# Compiles SOURCE and passes if the compiler refuses it with the message that the source's first
# line asks for:   // expect: <CMake regular expression>
# and, where it is GCC, the chips' compiler, with no other error behind it.
file(STRINGS ${SOURCE} first_line LIMIT_COUNT 1)
if(NOT first_line MATCHES "^// expect: (.+)$")
  message(FATAL_ERROR "${SOURCE}: the first line must be '// expect: <regex>'")
endif()
set(expected "${CMAKE_MATCH_1}")

string(REPLACE "|" ";-I;" includes "-I;${INCLUDE_DIRS}")
set(ENV{LC_ALL} C) # messages in English, with ASCII quotes
execute_process(COMMAND ${COMPILER} -std=c++${STANDARD} ${includes} -fsyntax-only ${SOURCE}
                RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0)
  message(FATAL_ERROR "${SOURCE} compiled; expected an error that matches: ${expected}")
elseif(NOT output MATCHES "${expected}")
  message(FATAL_ERROR "${SOURCE}: no message matches: ${expected}\nThe compiler said:\n${output}")
endif()
string(REGEX MATCHALL "error:" errors "${output}")
list(LENGTH errors count)
if(count GREATER 1 AND NOT COMPILER MATCHES "clang")
  message(FATAL_ERROR "${SOURCE}: ${count} errors, not one:\n${output}")
endif()
