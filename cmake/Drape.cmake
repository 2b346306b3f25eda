# SPDX-License-Identifier: Apache-2.0
# Each folder declares a library, a program and its unit tests with these three functions.

find_package(Eigen3 3.4 REQUIRED)
find_package(fmt REQUIRED)

# Equal input must give equal bytes, so the compiler may not contract a*b+c differently per target.
add_compile_options(-ffp-contract=off)

# The compiler starts garbage collection at 512 MB instead of 128 MB: 7 % less CPU time for the
# largest file of calib.
add_compile_options($<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=524288>)

# All sources of one target are compiled as one, since their headers are most of the work. OFF compiles
# each separately, which is better when changing one file at a time.
option(DRAPE_JOIN_SOURCES "Compile the sources of a target joined" ON)
set(CMAKE_UNITY_BUILD ${DRAPE_JOIN_SOURCES})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 0)

# A joined library is one object file, which a program links completely: the linker removes unused sections,
# a quarter of the programs of a compute node.
add_compile_options($<$<CONFIG:Release>:-ffunction-sections> $<$<CONFIG:Release>:-fdata-sections>)
add_link_options($<$<CONFIG:Release>:-Wl,--gc-sections>)

# A header that its own source file includes first is already compiled on its own (the test
# Sources.ASourceIncludesItsOwnHeaderFirst); a separate target compiles the others.
function(drape_verify_headers target)
  set(alone "")
  foreach(header IN LISTS ARGN)
    string(REGEX REPLACE "\\.hpp$" ".cpp" source ${header})
    if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${source})
      list(APPEND alone ${header})
    endif()
  endforeach()
  if(alone)
    target_sources(${target} PUBLIC FILE_SET alone TYPE HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${alone})
    set_target_properties(${target} PROPERTIES INTERFACE_HEADER_SETS_TO_VERIFY alone)
  else()
    set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS OFF)
  endif()
endfunction()

# What a program, or a file, is used for: the Debian package (drapebench-<use>, `tools`: drapebench).
function(drape_use_of_folder variable)
  file(RELATIVE_PATH here ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/.*" "" stage ${here})
  set(use tools)
  if(stage STREQUAL front)
    set(use common)
  elseif(stage STREQUAL simulate OR stage STREQUAL capture)
    set(use ${stage})
  endif()
  set(${variable} ${use} PARENT_SCOPE)
endfunction()

# drape_library(<folder> HEADERS ... SOURCES ... PUBLIC ... PRIVATE ...) makes drapebench::<folder>.
function(drape_library folder)
  cmake_parse_arguments(arg "" "" "HEADERS;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(drape_${folder} STATIC ${arg_SOURCES})
  add_library(drapebench::${folder} ALIAS drape_${folder})
  target_sources(drape_${folder} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${arg_HEADERS})
  drape_verify_headers(drape_${folder} ${arg_HEADERS})
  set_target_properties(drape_${folder} PROPERTIES EXPORT_NAME ${folder})
  target_link_libraries(drape_${folder} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  file(RELATIVE_PATH here ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  list(TRANSFORM arg_SOURCES PREPEND ${here}/)
  set_property(GLOBAL APPEND PROPERTY DRAPE_LIBRARY_SOURCES ${arg_SOURCES})
endfunction()

# drape_room(<stage>/<room> HEADERS ... SOURCES ... PUBLIC ... PRIVATE ...) makes drapebench::<stage>_<room>.
function(drape_room room)
  string(REPLACE "/" "_" name ${room})
  drape_library(${name} ${ARGN})
endfunction()

# drape_embed(<source> <namespace> <function> <name> <file> ...) writes a source with the function
# `const std::map<std::string, std::string_view>& function()`: the text of each file by name.
function(drape_embed source namespace function)
  set(entries "")
  set(files ${ARGN})
  while(files)
    list(POP_FRONT files name file)
    file(READ ${file} text)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    string(APPEND entries "{\"${name}\", R\"drape_text(${text})drape_text\"},\n")
  endwhile()
  file(CONFIGURE OUTPUT ${source} @ONLY CONTENT [[
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <string>
#include <string_view>
namespace @namespace@ {
const std::map<std::string, std::string_view>& @function@() {
  static const std::map<std::string, std::string_view> all = {
@entries@  };
  return all;
}
}  // namespace @namespace@
]])
endfunction()

# drape_moves_text(<target> ...): for code that reads options and files and writes pages and tables. Its time goes to
# the disk and the database, and -O1 compiles it in 0.6 to 0.8 of the time.
function(drape_moves_text)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
endfunction()

# drape_program(<name> SOURCES ... LINK ...) puts the executable into <build>/bin. The source with main()
# opens whole namespaces and may have to be the last.
function(drape_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} drapebench::program fmt::fmt)
  drape_moves_text(${name})
  set_property(GLOBAL APPEND PROPERTY DRAPE_PROGRAMS ${name})
  drape_use_of_folder(use)
  set_property(GLOBAL APPEND PROPERTY DRAPE_PROGRAMS_${use} ${name})
  install(TARGETS ${name} RUNTIME DESTINATION bin COMPONENT ${use})
endfunction()

# drape_helper(<name> SOURCES ... LINK ...) puts executables that only programs start into
# <build>/libexec/drapebench, beside bin as in an installation.
function(drape_helper name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} drapebench::program fmt::fmt)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/libexec/drapebench)
  drape_use_of_folder(use)
  install(TARGETS ${name} RUNTIME DESTINATION libexec/drapebench COMPONENT ${use})
endfunction()

# Ends only tests that hang, since a machine can be slow or busy.
set(DRAPE_TEST_TIMEOUT_S 3000)

# drape_test(<name> [CAMERAS] [FIRST] [PARTS n] SOURCES ... LINK ...) builds a GoogleTest program and registers
# its tests: each by its name, or, if all need a set-up that takes seconds, in n parts whose tests share
# it. CAMERAS labels tests that use cameras through Aravis. FIRST starts them first, so that no slow test
# remains when all others have ended.
function(drape_test name)
  if(NOT DRAPE_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "CAMERAS;FIRST" "PARTS" "SOURCES;LINK" ${ARGN})
  set(properties TIMEOUT ${DRAPE_TEST_TIMEOUT_S})
  if(arg_CAMERAS)
    list(APPEND properties LABELS cameras)
  endif()
  if(arg_FIRST)
    list(APPEND properties COST 100)
  endif()
  add_executable(${name} ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${arg_LINK} drapebench::core drapebench::test_support
                                        GTest::gmock GTest::gtest_main)
  # Saves a fifth of the compile time; the slow part of a test is the code under test.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(NOT arg_PARTS)
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT ${DRAPE_TEST_TIMEOUT_S}
                         PROPERTIES ${properties})
    return()
  endif()
  math(EXPR last "${arg_PARTS} - 1")
  foreach(part RANGE ${last})
    add_test(NAME ${name}/part_${part} COMMAND ${name})
    set_tests_properties(${name}/part_${part} PROPERTIES TIMEOUT ${DRAPE_TEST_TIMEOUT_S} COST 100
                         ENVIRONMENT "GTEST_TOTAL_SHARDS=${arg_PARTS};GTEST_SHARD_INDEX=${part}")
  endforeach()
endfunction()

# drape_benchmark(<name> SOURCES ... LINK ...) builds a Google Benchmark program into <build>/bench
# when DRAPE_BUILD_BENCHMARKS is on (preset `bench`). Benchmarks print; no test depends on a time.
function(drape_benchmark name)
  if(NOT DRAPE_BUILD_BENCHMARKS)
    return()
  endif()
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  find_package(benchmark REQUIRED)
  add_executable(${name} ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bench)
  target_link_libraries(${name} PRIVATE ${arg_LINK} drapebench::core benchmark::benchmark_main)
endfunction()

# The three OpenCV modules that read and filter images. Debian's module packages carry no
# OpenCVConfig.cmake of their own, and the package that does pulls in 150 more.
function(drape_find_opencv)
  if(TARGET drape_opencv)
    return()
  endif()
  find_path(DRAPE_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  add_library(drape_opencv INTERFACE)
  target_include_directories(drape_opencv SYSTEM INTERFACE ${DRAPE_OPENCV_INCLUDE})
  foreach(module core imgproc imgcodecs)
    find_library(DRAPE_OPENCV_${module} opencv_${module} REQUIRED)
    target_link_libraries(drape_opencv INTERFACE ${DRAPE_OPENCV_${module}})
  endforeach()
endfunction()

function(drape_find_apriltag)
  if(TARGET drape_apriltag)
    return()
  endif()
  find_path(DRAPE_APRILTAG_INCLUDE apriltag/apriltag.h REQUIRED)
  find_library(DRAPE_APRILTAG apriltag REQUIRED)
  add_library(drape_apriltag INTERFACE)
  target_include_directories(drape_apriltag SYSTEM INTERFACE ${DRAPE_APRILTAG_INCLUDE})
  target_link_libraries(drape_apriltag INTERFACE ${DRAPE_APRILTAG})
endfunction()
