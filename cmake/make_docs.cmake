# cmake -DDOXYGEN=<program> -DFOLDER=<build>/docs -P make_docs.cmake
# Runs Doxygen and fails on everything it complains about: wrong names of parameters, unknown commands, links to nothing, classes
# without a docstring. Members may do without one where their names say it all, units included.
execute_process(COMMAND ${DOXYGEN} ${FOLDER}/Doxyfile OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(STRINGS ${FOLDER}/warnings.log complaints)
list(FILTER complaints EXCLUDE REGEX "warning: Member .* is not documented\\.$")
if(complaints)
  list(JOIN complaints "\n  " text)
  message(FATAL_ERROR "API documentation:\n  ${text}")
endif()
