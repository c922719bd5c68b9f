# What `cmake --install` brings besides the programs: the front door's headers, the library (shared and static), and
# what find_package(Mouthpiece) and pkg-config need.
include(CMakePackageConfigHelpers)

# mouthpiece_rooms_behind(ROOM OUT): ROOM and all rooms that it needs; mouthpiece_libraries_behind: the outside ones.
function(mouthpiece_walk room)
  get_property(seen GLOBAL PROPERTY MOUTHPIECE_WALKED)
  if(room IN_LIST seen)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY MOUTHPIECE_WALKED ${room})
  get_target_property(links ${room} LINK_LIBRARIES)
  foreach(link ${links})
    string(REGEX REPLACE "^mouthpiece::" "mouthpiece_" target "${link}")
    get_property(rooms GLOBAL PROPERTY MOUTHPIECE_ROOMS)
    if(target IN_LIST rooms)
      mouthpiece_walk(${target})
    elseif(NOT link MATCHES "NOTFOUND")
      set_property(GLOBAL APPEND PROPERTY MOUTHPIECE_OUTSIDE ${link})
    endif()
  endforeach()
endfunction()

mouthpiece_walk(mouthpiece_speaker)
get_property(behind GLOBAL PROPERTY MOUTHPIECE_WALKED)
get_property(outside GLOBAL PROPERTY MOUTHPIECE_OUTSIDE)
list(REMOVE_DUPLICATES outside)
list(TRANSFORM behind REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)

foreach(kind shared static)
  string(TOUPPER ${kind} type)
  add_library(mouthpiece_${kind} ${type} ${objects})
  target_link_libraries(mouthpiece_${kind} PRIVATE ${outside})
  set_target_properties(mouthpiece_${kind} PROPERTIES OUTPUT_NAME mouthpiece LINKER_LANGUAGE CXX)
endforeach()
set_target_properties(mouthpiece_shared PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION 0)
# Templates of the standard library that a room instantiates are no part of the interface.
# What a sanitizer's code calls, the program that opens the library brings: there something is left undefined.
if(NOT CMAKE_CXX_FLAGS MATCHES -fsanitize)
  target_link_options(mouthpiece_shared PRIVATE "LINKER:--no-undefined")
endif()
target_link_options(mouthpiece_shared PRIVATE "LINKER:--exclude-libs,ALL"
  "LINKER:--version-script=${CMAKE_SOURCE_DIR}/cmake/mouthpiece.map")
set_property(TARGET mouthpiece_shared APPEND PROPERTY LINK_DEPENDS ${CMAKE_SOURCE_DIR}/cmake/mouthpiece.map)

# A program that links the static library needs the same outside libraries, by the names that the linker knows.
function(mouthpiece_linker_names library out)
  set(names)
  if(NOT TARGET ${library})
    if(NOT library MATCHES "::|[$]<")
      string(REGEX REPLACE "^([^-/].*)" "-l\\1" names "${library}")
    endif()
  else()
    get_target_property(type ${library} TYPE)
    if(NOT type STREQUAL "INTERFACE_LIBRARY")
      set(names $<TARGET_LINKER_FILE:${library}>)
    endif()
    get_target_property(parts ${library} INTERFACE_LINK_LIBRARIES)
    foreach(part ${parts})
      if(part)
        mouthpiece_linker_names(${part} more)
        list(APPEND names ${more})
      endif()
    endforeach()
  endif()
  set(${out} ${names} PARENT_SCOPE)
endfunction()
set(MOUTHPIECE_STATIC_LIBRARIES)
foreach(library ${outside})
  mouthpiece_linker_names(${library} names)
  list(APPEND MOUTHPIECE_STATIC_LIBRARIES ${names})
endforeach()
list(REMOVE_DUPLICATES MOUTHPIECE_STATIC_LIBRARIES)
list(APPEND MOUTHPIECE_STATIC_LIBRARIES -lpthread -lm)
list(JOIN MOUTHPIECE_STATIC_LIBRARIES " " MOUTHPIECE_STATIC_FLAGS)

configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/MouthpieceConfig.cmake.in
  ${CMAKE_BINARY_DIR}/package/MouthpieceConfig.cmake.in INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Mouthpiece
  PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR)
file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/package/MouthpieceConfig.cmake
  INPUT ${CMAKE_BINARY_DIR}/package/MouthpieceConfig.cmake.in)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/package/MouthpieceConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH MOUTHPIECE_PREFIX_FROM_PKGCONFIG /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
configure_file(${CMAKE_SOURCE_DIR}/cmake/mouthpiece.pc.in ${CMAKE_BINARY_DIR}/package/mouthpiece.pc.in @ONLY)
file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/package/mouthpiece.pc INPUT ${CMAKE_BINARY_DIR}/package/mouthpiece.pc.in)

install(TARGETS mouthpiece_shared mouthpiece_static LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(DIRECTORY include/mouthpiece DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h")
install(FILES ${CMAKE_BINARY_DIR}/package/MouthpieceConfig.cmake
  ${CMAKE_BINARY_DIR}/package/MouthpieceConfigVersion.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Mouthpiece
  COMPONENT development)
install(FILES ${CMAKE_BINARY_DIR}/package/mouthpiece.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
  COMPONENT development)
