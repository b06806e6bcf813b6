# Debian packages by CPack: `stairwell` (program, worlds, models, examples) and `stairwell-dev` (libraries, headers, CMake
# package). scripts/package.sh builds both.
set(stairwell_texts ${PROJECT_BINARY_DIR}/generated/share)
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${stairwell_texts}/changelog COPYONLY)
configure_file(${PROJECT_SOURCE_DIR}/packaging/changelog ${stairwell_texts}/changelog.Debian COPYONLY)
execute_process(COMMAND gzip -9nf ${stairwell_texts}/changelog ${stairwell_texts}/changelog.Debian
  COMMAND_ERROR_IS_FATAL ANY)
set(stairwell_documents ${stairwell_texts}/changelog.gz ${stairwell_texts}/changelog.Debian.gz
  ${PROJECT_SOURCE_DIR}/packaging/copyright)
install(FILES ${stairwell_documents} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stairwell COMPONENT program)
install(FILES ${stairwell_documents} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stairwell-dev COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stairwell COMPONENT program)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME stairwell)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "exploration of buildings with fleets of simulated UAVs")
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_PACKAGE_CONTACT "Stairwell maintainers <stairwell@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME stairwell)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "ffmpeg, octovis")
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION
  "Stairwell explores unknown multi-storey buildings with a fleet of simulated
UAVs and leaves an OctoMap. It reads SDFormat, meshes, OctoMaps, point clouds
and ROS map images as worlds, simulates depth cameras and lidars, plans
smooth trajectories, and measures runs against the true world.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME stairwell-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, liboctomap-dev, libpcl-dev, libompl-dev, libembree-dev, \
libsdformat-dev, libassimp-dev, libyaml-cpp-dev, libpng-dev, nlohmann-json3-dev")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION
  "Static libraries, headers and the CMake package of Stairwell, for programs of
one's own: mapping, planning, coverage, perception, simulation and the loop
of a fleet (find_package(stairwell)).")

include(CPack)
