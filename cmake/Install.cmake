# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` leaves: static libraries, their public headers, a CMake package with a component for each library,
# and a pkg-config file for each.
include(CMakePackageConfigHelpers)
set(ISOREEL_INSTALL_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/isoreel)

# isoreel_install(isoreel_NAME DESCRIPTION MODULES pkg-config modules … LIBRARIES plain names …)
# Call it when the library is complete. Who links an installed static library needs what its sources use: MODULES and
# LIBRARIES (those without a pkg-config file) say it once, for CMake and for pkg-config. The targets that it is linked
# with here stay out of the package.
function(isoreel_install name description)
  cmake_parse_arguments(arg "" "" "MODULES;LIBRARIES" ${ARGN})
  get_target_property(component ${name} EXPORT_NAME)
  get_target_property(links ${name} INTERFACE_LINK_LIBRARIES)
  set(interface "")
  set(needs "")
  foreach(link IN LISTS links)
    list(APPEND interface $<BUILD_INTERFACE:${link}>)
    if(link MATCHES "^isoreel_(.*)$")
      list(APPEND needs ${CMAKE_MATCH_1})
      list(APPEND interface $<INSTALL_INTERFACE:isoreel::${CMAKE_MATCH_1}>)
    endif()
  endforeach()
  if(arg_MODULES)
    list(APPEND interface $<INSTALL_INTERFACE:$<LINK_ONLY:PkgConfig::isoreel_needs_${component}>>)
  endif()
  foreach(library IN LISTS arg_LIBRARIES)
    list(APPEND interface $<INSTALL_INTERFACE:$<LINK_ONLY:${library}>>)
  endforeach()
  set_target_properties(${name} PROPERTIES INTERFACE_LINK_LIBRARIES "${interface}")

  install(TARGETS ${name} EXPORT isoreel-${component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT isoreel-${component} NAMESPACE isoreel:: DESTINATION ${ISOREEL_INSTALL_PACKAGE})
  set_property(GLOBAL APPEND PROPERTY ISOREEL_COMPONENTS ${component})
  set_property(GLOBAL APPEND_STRING PROPERTY ISOREEL_COMPONENT_LISTS
               "set(_isoreel_${component}_needs ${needs})\nset(_isoreel_${component}_modules ${arg_MODULES})\n")

  list(TRANSFORM needs PREPEND isoreel-)
  string(JOIN " " requires ${needs} ${arg_MODULES})
  list(TRANSFORM arg_LIBRARIES PREPEND -l)
  string(JOIN " " libraries ${arg_LIBRARIES})
  file(RELATIVE_PATH up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  string(REGEX REPLACE "/$" "" up ${up})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/isoreel.pc.in ${PROJECT_BINARY_DIR}/isoreel-${component}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/isoreel-${component}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

# After the last library: find_package(isoreel) for all of them.
function(isoreel_install_package)
  get_property(components GLOBAL PROPERTY ISOREEL_COMPONENTS)
  get_property(lists GLOBAL PROPERTY ISOREEL_COMPONENT_LISTS)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/isoreelConfig.cmake.in
                                ${PROJECT_BINARY_DIR}/isoreelConfig.cmake INSTALL_DESTINATION ${ISOREEL_INSTALL_PACKAGE})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/isoreelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/isoreelConfig.cmake ${PROJECT_BINARY_DIR}/isoreelConfigVersion.cmake
          DESTINATION ${ISOREEL_INSTALL_PACKAGE})
endfunction()
