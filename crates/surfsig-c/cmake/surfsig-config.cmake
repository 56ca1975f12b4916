# find_package(surfsig) gives surfsig::surfsig, the shared library, and surfsig::static.
get_filename_component(_surfsig_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(_surfsig_lib "${_surfsig_prefix}/lib")

if(NOT TARGET surfsig::surfsig)
  add_library(surfsig::surfsig SHARED IMPORTED)
  add_library(surfsig::static STATIC IMPORTED)
  if(WIN32)
    set_target_properties(surfsig::surfsig PROPERTIES
      IMPORTED_LOCATION "${_surfsig_lib}/surfsig_c.dll"
      IMPORTED_IMPLIB "${_surfsig_lib}/surfsig_c.dll.lib")
    set_target_properties(surfsig::static PROPERTIES
      IMPORTED_LOCATION "${_surfsig_lib}/surfsig_c.lib"
      INTERFACE_LINK_LIBRARIES "ws2_32;userenv;ntdll;bcrypt")
  elseif(APPLE)
    set_target_properties(surfsig::surfsig PROPERTIES
      IMPORTED_LOCATION "${_surfsig_lib}/libsurfsig_c.dylib"
      IMPORTED_SONAME "@rpath/libsurfsig_c.dylib")
    set_target_properties(surfsig::static PROPERTIES IMPORTED_LOCATION "${_surfsig_lib}/libsurfsig_c.a")
  else()
    set_target_properties(surfsig::surfsig PROPERTIES
      IMPORTED_LOCATION "${_surfsig_lib}/libsurfsig_c.so"
      IMPORTED_SONAME "libsurfsig_c.so")
    set_target_properties(surfsig::static PROPERTIES
      IMPORTED_LOCATION "${_surfsig_lib}/libsurfsig_c.a"
      INTERFACE_LINK_LIBRARIES "pthread;dl;m")
  endif()
  set_target_properties(surfsig::surfsig surfsig::static PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${_surfsig_prefix}/include")
endif()
