# facewright_embed(FUNCTION HEADER NAME=FILE...): makes ${CMAKE_CURRENT_BINARY_DIR}/assets.cpp, which defines the function of
# the header, std::optional<std::string_view> FUNCTION(const std::string& name): the bytes of each file, by its name.
function(facewright_embed asset_function asset_header)
  set(asset_files)
  set(asset_macros)
  set(asset_entries)
  set(number 0)
  foreach(asset ${ARGN})
    string(REGEX MATCH "^([^=]*)=(.*)$" _ ${asset})
    string(APPEND asset_macros "FACEWRIGHT_BYTES_OF(${asset_function}_${number}, \"${CMAKE_MATCH_2}\")\n")
    string(APPEND asset_entries
      "    {\"${CMAKE_MATCH_1}\", bytes(${asset_function}_${number}_begin, ${asset_function}_${number}_end)},\n")
    list(APPEND asset_files ${CMAKE_MATCH_2})
    math(EXPR number "${number} + 1")
  endforeach()
  configure_file(${PROJECT_SOURCE_DIR}/cmake/assets.cpp.in assets.cpp @ONLY)
  set_property(SOURCE ${CMAKE_CURRENT_BINARY_DIR}/assets.cpp PROPERTY OBJECT_DEPENDS "${asset_files}")
endfunction()
