# Installs the libraries with their headers, a CMake package `stairwell`, and the worlds. The program and its shell
# completion are installed by apps/.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(stairwell_all_libraries GLOBAL PROPERTY STAIRWELL_LIBRARIES)
set(stairwell_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/stairwell)

foreach(folder core sim3d perception mapping learning/nn planning3d coverage3d explore)
  get_filename_component(name ${folder} NAME)
  get_filename_component(parent ${folder} DIRECTORY)
  set(library stairwell_${name})
  if(NOT library IN_LIST stairwell_all_libraries)
    continue()
  endif()
  # OctoMap's package names its libraries by their paths on the building machine; an installed package must not.
  get_target_property(links ${library} INTERFACE_LINK_LIBRARIES)
  if(links)
    list(TRANSFORM links REPLACE "[^:;<>]*/lib(octomap|octomath)\\.(so|a)" "\\1")
    set_target_properties(${library} PROPERTIES INTERFACE_LINK_LIBRARIES "${links}")
  endif()
  install(TARGETS ${library} EXPORT stairwellTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/stairwell/${parent}
    COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN "torch_*.hpp" EXCLUDE)
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/generated/core/version.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/stairwell/core COMPONENT development)

install(EXPORT stairwellTargets NAMESPACE stairwell:: DESTINATION ${stairwell_package_dir}
  COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/stairwellConfig.cmake.in
  ${PROJECT_BINARY_DIR}/stairwellConfig.cmake INSTALL_DESTINATION ${stairwell_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/stairwellConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/stairwellConfig.cmake ${PROJECT_BINARY_DIR}/stairwellConfigVersion.cmake
  DESTINATION ${stairwell_package_dir} COMPONENT development)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/worlds/ DESTINATION ${CMAKE_INSTALL_DATADIR}/stairwell/worlds COMPONENT program)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/models/ DESTINATION ${CMAKE_INSTALL_DATADIR}/stairwell/models COMPONENT program)
# Debian has the licence's text already.
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stairwell COMPONENT licence)
