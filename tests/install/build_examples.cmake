# Configures and builds the examples against an installed prefix.
foreach(arguments "-S;${SOURCE};-B;${BINARY};-DCMAKE_PREFIX_PATH=${PREFIX};-DCMAKE_CXX_FLAGS=${FLAGS};-DCMAKE_C_FLAGS=${FLAGS}"
                  "--build;${BINARY}")
  execute_process(COMMAND ${CMAKE_COMMAND} ${arguments} RESULT_VARIABLE result)
  if(result)
    message(FATAL_ERROR "the examples do not build against ${PREFIX}")
  endif()
endforeach()
