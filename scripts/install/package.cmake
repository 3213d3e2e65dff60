# Manual pages, shell completion, and the Debian packages that `cpack` makes in the build folder:
# trueline (programs and their library) and trueline-dev (what another project compiles against).
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/trueline RENAME copyright
        COMPONENT programs)
set(TRUELINE_COMPLETIONS ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES scripts/install/completion.bash DESTINATION ${TRUELINE_COMPLETIONS} RENAME trueline
        COMPONENT programs)
install(CODE "
  set(BIN \"${PROJECT_BINARY_DIR}/apps\")
  set(SCRIPTS \"${PROJECT_SOURCE_DIR}/scripts/install\")
  set(MAN \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1\")
  set(COMPLETIONS \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${TRUELINE_COMPLETIONS}\")
  include(\"${PROJECT_SOURCE_DIR}/scripts/install/manuals.cmake\")" COMPONENT programs)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "Trueline <trueline@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs library)
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "calibrates drone models from flight logs
 Reads the log of a drone and returns the calibrated model, the trajectory, their uncertainties
 and the effects that the model lacks.")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "headers and CMake package of trueline")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME trueline)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/apps)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS
    "python3, python3-numpy, python3-pandas, python3-plotly, python3-yaml")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME trueline-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS
    "trueline (= ${PROJECT_VERSION}), libceres-dev, libeigen3-dev, libgflags-dev, \
libgoogle-glog-dev, libyaml-cpp-dev, libfmt-dev")
include(CPack)
