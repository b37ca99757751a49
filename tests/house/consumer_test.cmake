# Installs the project and builds docs/example_fit against the installed package, as a stranger would.
function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${what} failed (${code}):\n${out}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
run("install" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
if(EXISTS ${BUILD_DIR}/tools/help/files/written)
  foreach(file bash-completion/completions/fit-model zsh/site-functions/_fit-model fish/vendor_completions.d/fit-model.fish man/man1/fit-model.1)
    if(NOT EXISTS ${WORK_DIR}/prefix/share/${file})
      message(FATAL_ERROR "share/${file} was not installed")
    endif()
  endforeach()
endif()
run("configuring the example" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/docs/example_fit -B ${WORK_DIR}/build
  -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" -D CMAKE_PREFIX_PATH=${WORK_DIR}/prefix)
run("building the example" ${CMAKE_COMMAND} --build ${WORK_DIR}/build)

# Nothing of the registration side may have come along.
file(STRINGS ${WORK_DIR}/build/CMakeCache.txt heavy REGEX "^(CGAL|OpenMesh|flann|assimp)_DIR:PATH=/")
if(heavy)
  message(FATAL_ERROR "a program that only fits looked for ${heavy}")
endif()

# With the registration component the examples are built the same way.
file(GLOB_RECURSE registration ${WORK_DIR}/prefix/FacewrightRegistrationTargets.cmake)
if(registration)
  run("configuring the examples" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/examples -B ${WORK_DIR}/examples
    -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" -D CMAKE_PREFIX_PATH=${WORK_DIR}/prefix)
  run("building the examples" ${CMAKE_COMMAND} --build ${WORK_DIR}/examples)
endif()
file(REMOVE_RECURSE ${WORK_DIR})
