# SPDX-License-Identifier: Apache-2.0
drape_find_opencv()

drape_library(calib_exchange
  HEADERS exchange.hpp exchange_formats.hpp
  SOURCES exchange.cpp exchange_mrcal.cpp exchange_opencv.cpp exchange_refit.cpp exchange_text.cpp
  PUBLIC drapebench::core
  PRIVATE drape_opencv fmt::fmt)

drape_program(drape-calib-convert SOURCES exchange_main.cpp LINK drapebench::calib_exchange)

drape_test(calib_exchange_test SOURCES exchange_colmap_test.cpp exchange_test.cpp LINK drapebench::calib_exchange fmt::fmt)

# A second opinion, in the test alone and only where it is installed.
find_library(DRAPE_OPENCV_CALIB3D opencv_calib3d)
if(TARGET calib_exchange_test)
  target_link_libraries(calib_exchange_test PRIVATE drape_opencv)
  if(DRAPE_OPENCV_CALIB3D)
    target_link_libraries(calib_exchange_test PRIVATE ${DRAPE_OPENCV_CALIB3D})
    target_compile_definitions(calib_exchange_test PRIVATE DRAPE_HAS_OPENCV_CALIB3D)
  endif()
endif()
