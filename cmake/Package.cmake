# Installs what find_package(Facewright [COMPONENTS registration]) needs.
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Facewright)
install(EXPORT FacewrightTargets NAMESPACE facewright:: DESTINATION ${package_dir})
if(FACEWRIGHT_BUILD_REGISTRATION)
  install(EXPORT FacewrightRegistrationTargets NAMESPACE facewright:: DESTINATION ${package_dir})
endif()
configure_package_config_file(cmake/FacewrightConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/FacewrightConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/FacewrightConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/FacewrightConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/FacewrightConfigVersion.cmake
  DESTINATION ${package_dir})
install(FILES LICENSE NOTICE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
