# Of functions that are compiled in several files (weak: inline ones and templates) the linker keeps
# one. So all of those in wide_*<set>.cpp must have the set in their names: auvest's and xsimd's have,
# the standard library's and Eigen's have not and must be inlined, or not be used there.
foreach(object IN LISTS OBJECTS)
  if(NOT object MATCHES "/wide_(runs_)?([a-z0-9]+)\\.cpp[^/]*$")
    continue()
  endif()
  set(set ${CMAKE_MATCH_2})
  execute_process(COMMAND ${NM} --defined-only --format=posix ${object}
                  OUTPUT_VARIABLE symbols RESULT_VARIABLE result)
  string(REGEX MATCHALL "[^\n]+ W " functions "${symbols}")
  if(NOT result EQUAL 0 OR NOT functions)
    message(FATAL_ERROR "cannot read the names in ${object}")
  endif()
  list(FILTER functions EXCLUDE REGEX ${set})
  if(functions)
    string(REPLACE ";" "\n" functions "${functions}")
    message(FATAL_ERROR "functions for ${set} that may be taken for every processor's:\n${functions}")
  endif()
  list(APPEND checked ${set})
endforeach()
if(NOT checked)
  message(FATAL_ERROR "no object of wide_<set>.cpp among ${OBJECTS}")
endif()
