# Writes the manual pages of the programs and the links of the shell completion. Runs at
# installation, with BIN (folder of the built programs), SCRIPTS, MAN and COMPLETIONS (destinations).
file(GLOB programs "${BIN}/trueline*")
foreach(program IN LISTS programs)
  get_filename_component(name ${program} NAME)
  execute_process(COMMAND python3 ${SCRIPTS}/manual.py ${program} ${MAN}
                  COMMAND_ERROR_IS_FATAL ANY)
  if(NOT name STREQUAL "trueline")  # bash looks a completion up by the command's name
    file(CREATE_LINK trueline "${COMPLETIONS}/${name}" SYMBOLIC)
  endif()
endforeach()
