# Target `docs`: the API documentation by Doxygen, where that is installed (build/<preset>/docs/html). Warnings are errors.
find_package(Doxygen QUIET)
if(NOT DOXYGEN_FOUND)
  message(STATUS "Doxygen is not there: no target docs")
  return()
endif()
configure_file(${PROJECT_SOURCE_DIR}/docs/Doxyfile.in ${PROJECT_BINARY_DIR}/docs/Doxyfile @ONLY)
set(stairwell_make_docs ${CMAKE_COMMAND} -DDOXYGEN=${DOXYGEN_EXECUTABLE} -DFOLDER=${PROJECT_BINARY_DIR}/docs
  -P ${CMAKE_CURRENT_LIST_DIR}/make_docs.cmake)
add_custom_target(docs COMMAND ${stairwell_make_docs} VERBATIM)
if(STAIRWELL_BUILD_TESTS)
  add_test(NAME api_docs COMMAND ${stairwell_make_docs})
  set_tests_properties(api_docs PROPERTIES TIMEOUT 300)
endif()
