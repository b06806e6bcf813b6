# Compiler settings shared by every target, and the helper that declares a library of this project.
option(STAIRWELL_BUILD_TESTS "Build the tests" ON)
option(STAIRWELL_BUILD_EXAMPLES "Build the examples" ON)
option(STAIRWELL_BUILD_BENCHMARKS "Build the benchmarks (needs Google Benchmark)" OFF)
option(STAIRWELL_SANITIZE_ADDRESS "AddressSanitizer and UndefinedBehaviorSanitizer" OFF)
option(STAIRWELL_SANITIZE_THREAD "ThreadSanitizer" OFF)
option(STAIRWELL_FUZZ "Only the libFuzzer programs of tests/fuzz and what they need (clang)" OFF)
option(STAIRWELL_COVERAGE "Instrument for gcov" OFF)
option(STAIRWELL_WITH_TORCH "Training of the learned agents (needs LibTorch; what is trained runs without)" ON)
option(STAIRWELL_WERROR "Warnings are errors" ON)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

# OctoMap's ray walk is repeated operation for operation: no fused multiply-add behind our back.
add_compile_options(-Wall -Wextra -Wconversion -Wshadow -ffp-contract=off)
# GCC 12 warns wrongly about string concatenation (GCC bug 105651).
add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
# GCC's -Wconversion leaves signs alone, clang's does not; the ray walk has no branches on purpose.
add_compile_options($<$<CXX_COMPILER_ID:Clang>:-Wno-sign-conversion>
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical>
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-conditional-parentheses>)
if(STAIRWELL_WERROR)
  add_compile_options(-Werror)
endif()
if(STAIRWELL_SANITIZE_ADDRESS)
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  add_link_options(-fsanitize=address,undefined)
  # Eigen aligns by hand under AddressSanitizer, the PCL library was built without it, and each frees what the other has.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
  # std::regex under AddressSanitizer warns falsely (GCC bug 105562).
  add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()
if(STAIRWELL_SANITIZE_THREAD)
  add_compile_options(-fsanitize=thread)
  add_link_options(-fsanitize=thread)
endif()
if(STAIRWELL_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "STAIRWELL_FUZZ needs clang: libFuzzer is part of it")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined,float-cast-overflow
    -fno-omit-frame-pointer -fno-sanitize-recover=undefined,float-cast-overflow
    -fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/../tests/fuzz/vendor_headers.txt)
  # GCC defines this one; the functions with several instruction sets look for it.
  add_compile_definitions(__SANITIZE_ADDRESS__=1)
  # libFuzzer's own name for lower limits.
  add_compile_definitions(FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
  add_link_options(-fsanitize=address,undefined)
endif()
if(STAIRWELL_COVERAGE)
  add_compile_options(--coverage -fprofile-update=atomic)
  add_link_options(--coverage)
endif()

# stairwell_library(name SOURCES ... [LINK public libs ...] [PRIVATE_LINK vendor libs ...])
# Makes stairwell_<name> (alias stairwell::<name>) with the repository root as include directory.
function(stairwell_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(stairwell_${name} STATIC ${ARG_SOURCES})
  add_library(stairwell::${name} ALIAS stairwell_${name})
  set_target_properties(stairwell_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(stairwell_${name} PUBLIC cxx_std_20)
  target_include_directories(stairwell_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
    $<INSTALL_INTERFACE:include/stairwell>
    $<INSTALL_INTERFACE:include>)
  target_link_libraries(stairwell_${name} PUBLIC ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
  set_property(GLOBAL APPEND PROPERTY STAIRWELL_LIBRARIES stairwell_${name})
endfunction()
