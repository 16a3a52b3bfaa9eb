# What `cmake --install --component cpp` puts where, and how others find it.
include(CMakePackageConfigHelpers)
set(tensegrity_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/tensegrity)
set(tensegrity_pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
# The installed tree can be moved: its files name each other relatively.
file(RELATIVE_PATH tensegrity_pkgconfig_to_prefix
     ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})

# Headers of what is not built stay out: a program that includes them could not link.
install(DIRECTORY include/tensegrity DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT cpp
        PATTERN ipopt_solver.hpp EXCLUDE PATTERN tensegrity.h EXCLUDE)

# Installs target tensegrity_${part} with an export file of its own, so that the package can be used
# without what another part needs, and with a file for pkg-config.
function(tensegrity_install part pkgconfig)
  install(TARGETS tensegrity_${part} EXPORT tensegrity-${part}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cpp)
  install(EXPORT tensegrity-${part} NAMESPACE tensegrity::
          DESTINATION ${tensegrity_cmake_dir} COMPONENT cpp)
  configure_file(cmake/${pkgconfig}.pc.in ${pkgconfig}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${pkgconfig}.pc
          DESTINATION ${tensegrity_pkgconfig_dir} COMPONENT cpp)
endfunction()

# Headers alone serve every processor; a library only those of its own pointer size.
set(tensegrity_processor ARCH_INDEPENDENT)
tensegrity_install(core tensegrity)
if(TENSEGRITY_BUILD_IPOPT)
  tensegrity_install(ipopt tensegrity_ipopt)
  install(FILES include/tensegrity/shape/ipopt_solver.hpp
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tensegrity/shape COMPONENT cpp)
  set(tensegrity_processor "")
endif()
if(TENSEGRITY_BUILD_C)
  set(tensegrity_c_cflags "")
  if(tensegrity_c_definition)
    set(tensegrity_c_cflags " -D${tensegrity_c_definition}")
  endif()
  tensegrity_install(c tensegrity_c)
  install(FILES include/tensegrity/tensegrity.h
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tensegrity COMPONENT cpp)
  set(tensegrity_processor "")
endif()

configure_package_config_file(cmake/tensegrityConfig.cmake.in tensegrityConfig.cmake
  INSTALL_DESTINATION ${tensegrity_cmake_dir})
write_basic_package_version_file(tensegrityConfigVersion.cmake
  COMPATIBILITY SameMinorVersion ${tensegrity_processor})
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tensegrityConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/tensegrityConfigVersion.cmake
        DESTINATION ${tensegrity_cmake_dir} COMPONENT cpp)
