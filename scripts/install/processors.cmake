# What is installed runs on any amd64 processor and loses no speed where AVX2 is there: lib/ holds the
# library for every processor, lib/glibc-hwcaps/x86-64-v3/ the same compiled for AVX2 and FMA. The
# loader of glibc 2.33 or later takes the second where the processor has them. Each program loads one
# of them whole, so inline code of one never meets that of the other. The one that this build is not
# is compiled at installation, except with the environment variable TRUELINE_INSTALL_AS_BUILT.
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|amd64|AMD64" OR TRUELINE_SANITIZE)
  return()
endif()
option(TRUELINE_ANY_PROCESSOR "Install the library for every processor and for those with AVX2" ON)
if(NOT TRUELINE_ANY_PROCESSOR)
  return()
endif()

if(TRUELINE_AVX2)
  set(plain trueline_other_processor)
  set(fast trueline)
  set(other_has_avx2 OFF)
else()
  set(plain trueline)
  set(fast trueline_other_processor)
  set(other_has_avx2 ON)
endif()
trueline_library(trueline_other_processor ${other_has_avx2} ${PROJECT_BINARY_DIR}/other_processor)
set_target_properties(trueline_other_processor PROPERTIES EXCLUDE_FROM_ALL ON)
install(CODE "if(NOT DEFINED ENV{TRUELINE_INSTALL_AS_BUILT})
    execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${PROJECT_BINARY_DIR}\"
                    --target trueline_other_processor COMMAND_ERROR_IS_FATAL ANY)
  endif()" COMPONENT programs)
install(TARGETS ${plain} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT programs
        NAMELINK_SKIP OPTIONAL)
install(TARGETS ${fast} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/x86-64-v3
        COMPONENT programs NAMELINK_SKIP OPTIONAL)
