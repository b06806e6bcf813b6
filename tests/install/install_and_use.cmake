cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed (${status}): ${ARGN}\n${output}")
  endif()
endfunction()

function(require_files folder)
  foreach(file IN LISTS ARGN)
    if(NOT EXISTS ${folder}/${file})
      message(FATAL_ERROR "not installed: ${file}")
    endif()
  endforeach()
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
if(SANITIZE_ADDRESS)
  string(APPEND FLAGS " -fsanitize=address,undefined")
elseif(SANITIZE_THREAD)
  string(APPEND FLAGS " -fsanitize=thread")
elseif(COVERAGE)
  string(APPEND FLAGS " --coverage")
endif()

# The package must work on another machine and in another place: it names no paths of this one, and is moved.
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
file(GLOB package ${WORK}/first/lib*/cmake/stairwell/*.cmake ${WORK}/first/lib*/*/cmake/stairwell/*.cmake)
foreach(file IN LISTS package)
  file(STRINGS ${file} paths REGEX "${WORK}|/liboctom|${BUILD}")
  if(paths)
    message(FATAL_ERROR "${file} names paths of the building machine: ${paths}")
  endif()
endforeach()
file(RENAME ${WORK}/first ${WORK}/moved)

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/moved
  -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_FLAGS=${FLAGS}" -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/two_points ${WORK}/two_points.bt)
file(SIZE ${WORK}/two_points.bt size)
file(READ ${WORK}/two_points.bt head LIMIT 30)
if(size LESS 100 OR NOT head MATCHES "^# Octomap OcTree binary")
  message(FATAL_ERROR "two_points.bt is not an OctoMap file (${size} bytes)")
endif()
run(${WORK}/build/custom_sensor ${WORK}/room.bt)
run(${WORK}/build/plan_path ${WORK}/room.bt -1.5,-1,1.2 1.5,1,1.2)

# The learned agent needs the installed weights, wherever one stands.
run(${WORK}/moved/bin/stairwell --version)
run(${CMAKE_COMMAND} -E chdir ${WORK} ${WORK}/moved/bin/stairwell plan ${WORK}/moved/share/stairwell/worlds/duplex.sdf
  --from -3,-2,1 --to -2,-2,1 --planner agent2d --slice --resolution 0.2 --quiet)
if(EXISTS ${WORK}/moved/lib/stairwell/stairwell_training.so)
  run(${WORK}/moved/bin/stairwell train path2d --algo td3 --steps 1 --quiet --out ${WORK}/trained)
endif()

# What the Debian packages hold (CPack installs the same components).
foreach(component program development)
  run(${CMAKE_COMMAND} -E env DESTDIR=${WORK}/${component} ${CMAKE_COMMAND} --install ${BUILD} --prefix /usr
    --component ${component})
endforeach()
require_files(${WORK}/program/usr bin/stairwell share/man/man1/stairwell.1.gz
  share/bash-completion/completions/stairwell share/zsh/vendor-completions/_stairwell
  share/stairwell/worlds/office_tower.sdf share/stairwell/models/path2d.model share/stairwell/models/path3d.model
  share/doc/stairwell/copyright share/doc/stairwell/changelog.gz share/doc/stairwell/changelog.Debian.gz
  share/doc/stairwell/examples/outside/CMakeLists.txt)
require_files(${WORK}/development/usr include/stairwell/core/version.hpp include/stairwell/mapping/occupancy_map.hpp
  share/doc/stairwell-dev/copyright)
file(GLOB_RECURSE libraries ${WORK}/program/*.a ${WORK}/program/*.hpp.in ${WORK}/program/*/include/*)
if(libraries OR EXISTS ${WORK}/development/usr/bin)
  message(FATAL_ERROR "the packages hold each other's files: ${libraries}")
endif()
