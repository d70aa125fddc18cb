# How the project's own targets are compiled. Users of auvest::auvest get none of this.

if(CMAKE_SOURCE_DIR STREQUAL PROJECT_SOURCE_DIR)
  set(CMAKE_CXX_EXTENSIONS OFF)
  if(NOT CMAKE_CXX_STANDARD)
    set(CMAKE_CXX_STANDARD 11)
  endif()
  if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release)
  endif()
endif()

# The instruction sets of SIMD code that is chosen at run time.
set(auvest_flags_avx2 -mavx2)
set(auvest_flags_avx512 -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -mtune=skylake-avx512)

# auvest_own(target): the library, warnings as errors, sanitizers where AUVEST_SANITIZE is set.
function(auvest_own target)
  target_link_libraries(${target} PRIVATE auvest::auvest)
  # simulation/ and desk/: headers that never ship to a chip.
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/cpp)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow -Wdouble-promotion
                                           -Werror)
  if(AUVEST_SANITIZE)
    # Null and misaligned references, a fifth of the compiler's time, are looked for by libFuzzer's
    # harness; a use of the first ends in the address sanitizer here, too.
    set(flags -fsanitize=address,undefined,float-cast-overflow -fno-sanitize=null,alignment
              -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_compile_options(${target} PRIVATE ${flags})
    target_link_options(${target} PRIVATE ${flags})
  endif()
endfunction()

# auvest_executable(name source): with AUVEST_SYNTAX_ONLY no more than whether it compiles.
function(auvest_executable name source)
  if(AUVEST_SYNTAX_ONLY)
    add_library(${name} OBJECT ${source})
    target_compile_options(${name} PRIVATE -fsyntax-only)
  else()
    find_package(Threads REQUIRED)
    add_executable(${name} ${source})
    target_link_libraries(${name} PRIVATE Threads::Threads)
  endif()
  auvest_own(${name})
endfunction()

# auvest_executables(): each .cpp of the folder is one executable of the same name; they are
# returned in the caller's variable `executables`.
function(auvest_executables)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  foreach(source IN LISTS sources)
    get_filename_component(name ${source} NAME_WE)
    auvest_executable(${name} ${source})
    list(APPEND executables ${name})
  endforeach()
  set(executables ${executables} PARENT_SCOPE)
endfunction()
