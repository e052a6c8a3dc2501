# The package Armor: components in C and C++.
#
#   find_package(Armor 0.1 REQUIRED)
#   add_executable(component src/main.c)
#   target_link_libraries(component PRIVATE Armor::armor)
#
# Armor::armor is the static library: the executable needs nothing else where it runs.
# Armor::shared is the shared one.
#
#   armor_test_manifest(component)
#
# adds a test to ctest that runs `--describe`: it fails if the ports or parameters contradict each other.

include(CMakeFindDependencyMacro)
find_dependency(Threads)

get_filename_component(_armor_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET Armor::armor)
  add_library(Armor::armor STATIC IMPORTED)
  set_target_properties(Armor::armor PROPERTIES
    IMPORTED_LOCATION "${_armor_prefix}/lib/libarmor.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_armor_prefix}/include/armor"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;m;${CMAKE_DL_LIBS};gcc_s")
  add_library(Armor::shared SHARED IMPORTED)
  set_target_properties(Armor::shared PROPERTIES
    IMPORTED_LOCATION "${_armor_prefix}/lib/libarmor.so"
    IMPORTED_SONAME "libarmor.so.@INTERFACE@"
    INTERFACE_INCLUDE_DIRECTORIES "${_armor_prefix}/include/armor")
endif()

foreach(_armor_file lib/libarmor.a lib/libarmor.so include/armor/armor.h)
  if(NOT EXISTS "${_armor_prefix}/${_armor_file}")
    set(Armor_FOUND FALSE)
    set(Armor_NOT_FOUND_MESSAGE
      "${_armor_prefix}/${_armor_file} is missing: install Armor again with sdk/c/install.sh ${_armor_prefix}")
  endif()
endforeach()

function(armor_test_manifest target)
  add_test(NAME ${target}-manifest COMMAND ${target} --describe)
endfunction()
