# cmake -DSOURCE=<repository> -DHEADER=<file> -P commit_header.cmake
# Writes the header that names the commit that is built; the file stays as it is while that is the same.
execute_process(COMMAND git -C ${SOURCE} rev-parse --short HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
  ERROR_QUIET)
if(NOT commit)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${HEADER} @ONLY CONTENT [[
#pragma once

namespace stairwell::apps {

inline constexpr const char* kBuiltFrom = "@commit@";

}  // namespace stairwell::apps
]])
