# `cmake --install`: the header, the shared library, what find_package(sgrt) and pkg-config need, the examples, and the
# notices of what others wrote and the library holds compiled. No C++, no core.
include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sgrt)

install(FILES include/sgrt.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY LICENSES packaging/notices DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.c" PATTERN "*.py"
        PATTERN "__pycache__" EXCLUDE)
install(TARGETS sgrt EXPORT sgrtTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT sgrtTargets NAMESPACE sgrt:: DESTINATION ${config_dir})

configure_package_config_file(cmake/sgrtConfig.cmake.in sgrtConfig.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(sgrtConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sgrtConfig.cmake ${PROJECT_BINARY_DIR}/sgrtConfigVersion.cmake
        DESTINATION ${config_dir})

# Paths from the .pc file's own folder, so that the whole prefix can be moved.
set(pkgconfig_dir ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig)
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY ${pkgconfig_dir} OUTPUT_VARIABLE libdir_from_pc)
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_INCLUDEDIR BASE_DIRECTORY ${pkgconfig_dir} OUTPUT_VARIABLE includedir_from_pc)
configure_file(cmake/sgrt.pc.in sgrt.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/sgrt.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
