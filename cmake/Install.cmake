# SPDX-License-Identifier: Apache-2.0
# Manual pages, bash completion, cmake --install, and Debian packages by what a machine is used for.

get_property(programs GLOBAL PROPERTY DRAPE_PROGRAMS)
set(manuals ${PROJECT_BINARY_DIR}/manuals)
add_custom_command(
  OUTPUT ${manuals}/completions/drape
  COMMAND ${PROJECT_SOURCE_DIR}/cmake/manuals.sh ${manuals} ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${programs}
  DEPENDS ${programs} cmake/manuals.sh cmake/help.awk cmake/manual.awk cmake/completion.bash CITATION.cff
  COMMENT "Writing the manual pages" VERBATIM)
add_custom_target(manuals ALL DEPENDS ${manuals}/completions/drape)

set(uses common)
foreach(use simulate capture tools)
  get_property(has GLOBAL PROPERTY DRAPE_PROGRAMS_${use})
  if(has)
    list(APPEND uses ${use})
  endif()
endforeach()

install(FILES ${manuals}/completions/drape DESTINATION share/bash-completion/completions COMPONENT common)
foreach(page drape drape-run drape-check drape-new drape-calib-images)
  install(FILES ${manuals}/man1/${page}.1.gz DESTINATION share/man/man1 COMPONENT common)
endforeach()
foreach(use IN LISTS uses)
  get_property(programs_of_use GLOBAL PROPERTY DRAPE_PROGRAMS_${use})
  list(REMOVE_ITEM programs_of_use drape)
  foreach(program IN LISTS programs_of_use)
    install(FILES ${manuals}/man1/${program}.1.gz DESTINATION share/man/man1 COMPONENT ${use})
  endforeach()
endforeach()
# The example bench and the paper's scenes; the programs only read them.
install(DIRECTORY rigs DESTINATION share/drapebench COMPONENT tools REGEX "fabrics/published.csv$" EXCLUDE)
if(TARGET drape-bench)
  install(FILES tools/desktop/drapebench-console.desktop tools/desktop/drapebench-folder.desktop
          DESTINATION share/applications COMPONENT tools)
  install(FILES tools/desktop/drapebench-console.metainfo.xml DESTINATION share/metainfo COMPONENT tools)
  install(FILES tools/desktop/drapebench.svg DESTINATION share/icons/hicolor/scalable/apps COMPONENT tools)
endif()
if(TARGET drape_simulate_mesh)
  install(FILES rigs/fabrics/published.csv DESTINATION share/drapebench/rigs/fabrics COMPONENT simulate)
  install(DIRECTORY tools/jobs DESTINATION share/drapebench COMPONENT simulate USE_SOURCE_PERMISSIONS)
endif()

# Core and cloth for use in other programs: find_package(drapebench), drapebench::simulate_mesh.
set(libraries drape_core drape_core_drawing drape_simulate_fabric drape_simulate_sparse drape_simulate_mesh)
if(TARGET drape_simulate_mesh)
  list(APPEND uses dev)
  install(TARGETS ${libraries} EXPORT drapebench COMPONENT dev ARCHIVE DESTINATION lib/drapebench
          FILE_SET HEADERS DESTINATION include/drapebench
          FILE_SET alone DESTINATION include/drapebench)
  set(package lib/cmake/drapebench)
  install(EXPORT drapebench NAMESPACE drapebench:: FILE drapebenchTargets.cmake DESTINATION ${package}
          COMPONENT dev)
  file(CONFIGURE OUTPUT drapebenchConfig.cmake @ONLY CONTENT [[
include(CMakeFindDependencyMacro)
foreach(library Eigen3 fmt nlohmann_json OpenSSL Threads)
  find_dependency(${library})
endforeach()
include(${CMAKE_CURRENT_LIST_DIR}/drapebenchTargets.cmake)
]])
  include(CMakePackageConfigHelpers)
  write_basic_package_version_file(drapebenchConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/drapebenchConfig.cmake
                ${CMAKE_CURRENT_BINARY_DIR}/drapebenchConfigVersion.cmake
          DESTINATION ${package} COMPONENT dev)
  install(DIRECTORY tests/packages/example DESTINATION share/doc/drapebench-dev COMPONENT dev)
endif()

# Name of whoever distributes the packages.
set(DRAPE_CONTACT "The drapebench developers <drapebench@localhost.localdomain>" CACHE STRING
    "Maintainer of the Debian packages")
# Debian's policy requires a copyright file and a changelog in its format in every package.
file(CONFIGURE OUTPUT copyright @ONLY CONTENT [[
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: drapebench

Files: *
Copyright: 2026 The drapebench developers
License: Apache-2.0
 On Debian systems the text of the licence is in /usr/share/common-licenses/Apache-2.0.
]])
file(STRINGS CITATION.cff released REGEX "^date-released: ")
string(REGEX REPLACE "^date-released: *" "" released "${released}")
file(CONFIGURE OUTPUT changelog.in @ONLY CONTENT [[
drapebench (@PROJECT_VERSION@) unstable; urgency=medium

  * See NEWS.gz.

 -- @DRAPE_CONTACT@  @released@
]])
add_custom_command(
  OUTPUT ${PROJECT_BINARY_DIR}/changelog.gz ${PROJECT_BINARY_DIR}/NEWS.gz
  COMMAND sh -c "sed \"s/${released}$/$(date -uRd ${released})/\" ${PROJECT_BINARY_DIR}/changelog.in | gzip -9n >${PROJECT_BINARY_DIR}/changelog.gz && gzip -9nc CHANGELOG.md >${PROJECT_BINARY_DIR}/NEWS.gz"
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} DEPENDS CHANGELOG.md CITATION.cff VERBATIM)
add_custom_target(changelog ALL DEPENDS ${PROJECT_BINARY_DIR}/changelog.gz)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME drapebench)
set(CPACK_PACKAGE_CONTACT "${DRAPE_CONTACT}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL ${uses})
set(same "(= ${PROJECT_VERSION})")
# drape_package(<use> NAME ... SUMMARY ... TEXT ... DEPENDS ...)
function(drape_package use)
  cmake_parse_arguments(arg "" "NAME;SUMMARY;TEXT" "DEPENDS" ${ARGN})
  string(TOUPPER ${use} key)
  string(REPLACE ";" ", " depends "${arg_DEPENDS}")
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${arg_NAME} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${arg_SUMMARY}\n${arg_TEXT}" PARENT_SCOPE)
  install(FILES ${PROJECT_BINARY_DIR}/copyright ${PROJECT_BINARY_DIR}/changelog.gz ${PROJECT_BINARY_DIR}/NEWS.gz
          DESTINATION share/doc/${arg_NAME} COMPONENT ${use})
  file(WRITE ${PROJECT_BINARY_DIR}/overrides/${arg_NAME}
       "# Built for its own machines; DRAPE_CONTACT names who gives it to others.\n"
       "${arg_NAME}: bogus-mail-host Maintainer *\n"
       "${arg_NAME}: bogus-mail-host-in-debian-changelog *\n")
  install(FILES ${PROJECT_BINARY_DIR}/overrides/${arg_NAME} DESTINATION share/lintian/overrides COMPONENT ${use})
endfunction()
drape_package(common NAME drapebench-common SUMMARY "measures simulated against real drapes: command"
              TEXT "The command drape, which runs the programs of the other packages,\nand its shell completion.")
drape_package(simulate NAME drapebench-simulate DEPENDS "drapebench-common ${same}"
              SUMMARY "simulates the drape of a cloth from its Kawabata curves"
              TEXT "For compute nodes: simulation, studies in parts, equilibria,\nsensitivities, and the checker of a drape.")
drape_package(capture NAME drapebench-capture DEPENDS "drapebench-common ${same}"
              SUMMARY "records a draped cloth with several cameras at once"
              TEXT "For the machine at the cameras: GigE Vision, USB3 Vision and V4L2,\nchecks of the bench, import.")
set(tools_need "drapebench-common ${same}")
foreach(use simulate capture)
  if(use IN_LIST uses)
    list(APPEND tools_need "drapebench-${use} ${same}")
  endif()
endforeach()
drape_package(tools NAME drapebench DEPENDS ${tools_need}
              SUMMARY "measures how far a simulated drape is from the real one"
              TEXT "Calibration, marks, triangulation, comparison, results store and\nreport, and an example bench with recorded images.")
if(TARGET drape_simulate_mesh)
  drape_package(dev NAME drapebench-dev
                DEPENDS libeigen3-dev libfmt-dev nlohmann-json3-dev libssl-dev
                SUMMARY "cloth model of drapebench as a C++ library"
                TEXT "Headers, static libraries and CMake package of core and of the cloth,\nwith an example.")
  set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
endif()
include(CPack)
