# No instruction of AVX or later outside the code for it: see wide_instructions.awk.
execute_process(
  COMMAND ${OBJDUMP} --disassemble --no-show-raw-insn --section=.text ${MODULE}
  COMMAND ${AWK} -f ${SCRIPT}
  OUTPUT_VARIABLE functions RESULTS_VARIABLE results ERROR_VARIABLE errors)
if(NOT results STREQUAL "0;0")
  message(FATAL_ERROR "cannot disassemble ${MODULE}: ${errors}")
endif()
if(functions)
  message(FATAL_ERROR "AVX instructions where any processor may come, in:\n${functions}")
endif()
