# Pictures and reports: a library of its own, so that it builds and is tested without the rest of the program.
file(READ ${PROJECT_SOURCE_DIR}/viewer/dist/viewer.js STAIRWELL_VIEWER_SCRIPT)
file(READ ${PROJECT_SOURCE_DIR}/viewer/src/page.css STAIRWELL_VIEWER_STYLE)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
  ${PROJECT_SOURCE_DIR}/viewer/dist/viewer.js ${PROJECT_SOURCE_DIR}/viewer/src/page.css)
configure_file(${PROJECT_SOURCE_DIR}/apps/viewer_files.hpp.in ${PROJECT_BINARY_DIR}/generated/apps/viewer_files.hpp @ONLY)

stairwell_library(render
  SOURCES atomic_file.cpp bitmap_font.cpp byte_codec.cpp cast_storey.cpp canvas.cpp csv_table.cpp curve_picture.cpp page.cpp png_writer.cpp render.cpp
    replay_file.cpp report.cpp report_data.cpp report_plots.cpp svg_plot.cpp voxel_scene.cpp
  LINK stairwell::core stairwell::sim3d stairwell::perception stairwell::mapping
  PRIVATE_LINK PNG::PNG ZLIB::ZLIB nlohmann_json::nlohmann_json)
