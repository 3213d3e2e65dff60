# Manual pages, shell completion, and the Debian packages that `cpack` makes in the build folder:
# trueline (programs and their library), trueline-dev (what another project compiles against) and
# python3-trueline (the Python module).
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
if(TARGET trueline_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "calibrates drone models from flight logs
 Reads the log of a drone and returns the calibrated model, the trajectory, their uncertainties
 and the effects that the model lacks.")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "headers and CMake package of trueline")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Python module of trueline
 The verbs of trueline on NumPy arrays and log folders, with results as objects.")
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
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-trueline)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS  # the module is built for one version of Python
    "trueline (= ${PROJECT_VERSION}), ${TRUELINE_PYTHON}, python3-numpy, python3-pandas, python3-yaml")
include(CPack)
