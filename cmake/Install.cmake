# SPDX-License-Identifier: Apache-2.0
# cmake --install, and Debian packages by what a machine is used for.

set(uses common)
foreach(use simulate capture tools)
  get_property(has GLOBAL PROPERTY DRAPE_PROGRAMS_${use})
  if(has)
    list(APPEND uses ${use})
  endif()
endforeach()

# The example bench and the paper's scenes; the programs only read them.
install(DIRECTORY rigs DESTINATION share/drapebench COMPONENT tools)

# Debian's policy wants a copyright file and a compressed changelog in every package.
file(CONFIGURE OUTPUT copyright @ONLY CONTENT [[
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: drapebench

Files: *
Copyright: The drapebench developers
License: Apache-2.0
 On Debian systems the text of the licence is in /usr/share/common-licenses/Apache-2.0.
]])
add_custom_command(
  OUTPUT ${PROJECT_BINARY_DIR}/changelog.gz
  COMMAND sh -c "gzip -9nc CHANGELOG.md >${PROJECT_BINARY_DIR}/changelog.gz"
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} DEPENDS CHANGELOG.md VERBATIM)
add_custom_target(changelog ALL DEPENDS ${PROJECT_BINARY_DIR}/changelog.gz)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME drapebench)
set(CPACK_PACKAGE_CONTACT "The drapebench developers <drapebench@localhost.localdomain>")
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
  install(FILES ${PROJECT_BINARY_DIR}/copyright ${PROJECT_BINARY_DIR}/changelog.gz
          DESTINATION share/doc/${arg_NAME} COMPONENT ${use})
endfunction()
drape_package(common NAME drapebench-common SUMMARY "measures simulated against real drapes: command"
              TEXT "The command drape, which runs the programs of the other packages.")
drape_package(simulate NAME drapebench-simulate DEPENDS "drapebench-common ${same}"
              SUMMARY "simulates the drape of a cloth from its Kawabata curves"
              TEXT "For compute nodes: simulation, studies, equilibria, sensitivities, and the checker of a drape.")
drape_package(capture NAME drapebench-capture DEPENDS "drapebench-common ${same}"
              SUMMARY "records a draped cloth with several cameras at once"
              TEXT "For the machine at the cameras: GigE Vision, USB3 Vision and V4L2, checks of the bench, import.")
set(tools_need "drapebench-common ${same}")
foreach(use simulate capture)
  if(use IN_LIST uses)
    list(APPEND tools_need "drapebench-${use} ${same}")
  endif()
endforeach()
drape_package(tools NAME drapebench DEPENDS ${tools_need}
              SUMMARY "measures how far a simulated drape is from the real one"
              TEXT "Calibration, marks, triangulation, comparison, results store and report, and an example bench with recorded images.")
include(CPack)
