# The scripts and styles of the report's page become a source of stereo_slam_report, so that the program needs no files beside it.
set(page_files
  page/page.html page/page.css page/loader.js
  page/charts.js page/compare.js page/cursor_panel.js page/dom.js page/format.js page/main.js page/parts.js page/run.js page/run_charts.js
  page/run_scene.js page/scale.js page/status.js page/top_view.js page/view3d.js
  vendor/three/LineMaterial.js vendor/three/LineSegments2.js vendor/three/LineSegmentsGeometry.js vendor/three/OrbitControls.js
  vendor/three/three.core.min.js vendor/three/three.module.min.js vendor/uplot/uPlot.iife.min.js vendor/uplot/uPlot.min.css)
list(TRANSFORM page_files PREPEND ${CMAKE_CURRENT_LIST_DIR}/)
set(page_source ${CMAKE_CURRENT_BINARY_DIR}/page_files.cpp)
add_custom_command(OUTPUT ${page_source}
  COMMAND ${CMAKE_COMMAND} -DOUTPUT=${page_source} "-DFILES=${page_files}" -P ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake
  DEPENDS ${page_files} ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake
  COMMENT "Embedding the report's page"
  VERBATIM)
set_source_files_properties(${page_source} PROPERTIES
  COMPILE_OPTIONS -Wno-overlength-strings
  SKIP_PRECOMPILE_HEADERS ON
  SKIP_UNITY_BUILD_INCLUSION ON)
target_sources(stereo_slam_report PRIVATE ${page_source})
