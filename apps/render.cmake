# Pictures and reports: a library of its own, so that it builds and is tested without the rest of the program.
stairwell_library(render
  SOURCES atomic_file.cpp bitmap_font.cpp cast_storey.cpp canvas.cpp csv_table.cpp png_writer.cpp render.cpp report.cpp svg_plot.cpp voxel_scene.cpp
  LINK stairwell::core stairwell::sim3d stairwell::perception stairwell::mapping
  PRIVATE_LINK PNG::PNG nlohmann_json::nlohmann_json)
