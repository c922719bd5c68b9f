# Installs the locked Node modules into INSTALL_DIR/node_modules, unless those of this very lock file are there already:
# a second build needs no network.
file(SHA256 ${PACKAGE_DIR}/package-lock.json wanted)
string(APPEND wanted " test tools: ${WITH_TEST_TOOLS}\n")
set(stamp ${INSTALL_DIR}/node_modules/.mouthpiece-lock)
if(EXISTS ${stamp})
  file(READ ${stamp} installed)
  if(installed STREQUAL wanted)
    return()
  endif()
endif()

file(COPY ${PACKAGE_DIR}/package.json ${PACKAGE_DIR}/package-lock.json ${PACKAGE_DIR}/.npmrc DESTINATION ${INSTALL_DIR})
set(omit)
if(NOT WITH_TEST_TOOLS)
  set(omit --omit=dev)
endif()
execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline ${omit}
  WORKING_DIRECTORY ${INSTALL_DIR} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "npm could not install the viewer's packages (is the network up?):\n${output}")
endif()
file(WRITE ${stamp} "${wanted}")
