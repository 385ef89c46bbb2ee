# SPDX-License-Identifier: BSD-3-Clause
# How every target of the house is built, and which way includes may go.

# Warnings, sanitizers and exact floating point for a target of ours.
function(isoreel_settings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow
                         -ffp-contract=off)
  if(ISOREEL_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(ISOREEL_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${ISOREEL_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    if(ISOREEL_UNSANITIZED)  # in folders of which sanitizers would find nothing worth the time of compiling
      target_compile_options(${target} PRIVATE -fno-sanitize=${ISOREEL_UNSANITIZED})
    endif()
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      # GCC 12 sees uninitialised members in its own std::regex once sanitizers are on.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
    target_link_options(${target} PUBLIC -fsanitize=${ISOREEL_SANITIZE})
  endif()
endfunction()

# isoreel_objects(NAME HEADERS a.h … SOURCES b.cc … LINKS targets …)
# An object library with the public headers of FOLDER/include (each compiled alone by the all_verify_interface_header_sets
# target). It sees only its own folder and what LINKS give it: an include that runs against the direction of the house
# does not compile.
function(isoreel_objects name)
  cmake_parse_arguments(arg "" "" "HEADERS;SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(${name} OBJECT ${arg_SOURCES})
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR}/include FILES ${arg_HEADERS})
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${arg_LINKS} PRIVATE ${arg_PRIVATE_LINKS})
  set_target_properties(${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  isoreel_settings(${name})
endfunction()

# isoreel_library(isoreel_NAME HEADERS a.h … SOURCES b.cc … LINKS targets … PRIVATE_LINKS targets …)
# The same as a static library isoreel::NAME (libisoreel-NAME.a), for folders above the codec.
function(isoreel_library name)
  cmake_parse_arguments(arg "" "" "HEADERS;SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_sources(${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR}/include FILES ${arg_HEADERS})
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${arg_LINKS} PRIVATE ${arg_PRIVATE_LINKS})
  set_target_properties(${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  isoreel_settings(${name})
  isoreel_name(${name})
endfunction()

# isoreel_archive(isoreel_NAME OBJECTS libraries … LINKS targets … PRIVATE_LINKS targets …)
# A static library of object libraries and their public headers. Users see it and not the parts.
function(isoreel_archive name)
  cmake_parse_arguments(arg "" "" "OBJECTS;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(${name} STATIC)
  foreach(objects IN LISTS arg_OBJECTS)
    get_target_property(folders ${objects} HEADER_DIRS)
    get_target_property(headers ${objects} HEADER_SET)
    target_sources(${name} PRIVATE $<TARGET_OBJECTS:${objects}>
                           PUBLIC FILE_SET HEADERS BASE_DIRS ${folders} FILES ${headers})
  endforeach()
  target_link_libraries(${name} PUBLIC ${arg_LINKS} PRIVATE ${arg_PRIVATE_LINKS})
  set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
  if(ISOREEL_SANITIZE)
    target_link_options(${name} PUBLIC -fsanitize=${ISOREEL_SANITIZE})
  endif()
  isoreel_name(${name})
endfunction()

# isoreel_NAME for people: isoreel::NAME, libisoreel-NAME.a.
function(isoreel_name name)
  string(REPLACE "isoreel_" "" component ${name})
  target_compile_features(${name} INTERFACE cxx_std_20)
  set_target_properties(${name} PROPERTIES OUTPUT_NAME isoreel-${component} EXPORT_NAME ${component})
  add_library(isoreel::${component} ALIAS ${name})
endfunction()
