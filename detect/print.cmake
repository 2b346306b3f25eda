# SPDX-License-Identifier: Apache-2.0
drape_library(print
  HEADERS print_layout.hpp print_page.hpp print_tags.hpp
  SOURCES print_layout.cpp print_page.cpp print_tags.cpp tag_family.cpp
  PUBLIC drapebench::core
  PRIVATE ${DRAPE_APRILTAG} fmt::fmt)
target_include_directories(drape_print SYSTEM PRIVATE ${DRAPE_APRILTAG_INCLUDE})

drape_program(drape-print SOURCES print_main.cpp LINK drapebench::print)

drape_test(drape_print_test SOURCES print_test.cpp
  LINK drapebench::print drapebench::detect drape_opencv TIMEOUT 600)

# Targets of corners: chessboards, ChArUco boards, AprilGrids.
target_sources(drape_detect
  PRIVATE board.cpp board_map.cpp corner_covariance.cpp light_growth.cpp tag_family.cpp
  PUBLIC FILE_SET HEADERS FILES board.hpp board_map.hpp corner_covariance.hpp light_growth.hpp tag_family.hpp)
