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
  install(TARGETS ${library} EXPORT stairwellTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/stairwell/${parent}
    FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/generated/core/version.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/stairwell/core)

install(EXPORT stairwellTargets NAMESPACE stairwell:: DESTINATION ${stairwell_package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/stairwellConfig.cmake.in
  ${PROJECT_BINARY_DIR}/stairwellConfig.cmake INSTALL_DESTINATION ${stairwell_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/stairwellConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/stairwellConfig.cmake ${PROJECT_BINARY_DIR}/stairwellConfigVersion.cmake
  DESTINATION ${stairwell_package_dir})

install(DIRECTORY ${PROJECT_SOURCE_DIR}/worlds/ DESTINATION ${CMAKE_INSTALL_DATADIR}/stairwell/worlds)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/models/ DESTINATION ${CMAKE_INSTALL_DATADIR}/stairwell/models)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stairwell)
