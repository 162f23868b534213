# cmake -D folder=... -D output=... -P page_files.cmake: the files of a folder as a source file that
# defines PageFiles (page.h).
file(GLOB files RELATIVE "${folder}" "${folder}/*")
set(types "html=text/html" "js=text/javascript" "css=text/css" "svg=image/svg+xml")
set(entries "")
set(arrays "")
foreach(file ${files})
  file(READ "${folder}/${file}" bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
  string(MAKE_C_IDENTIFIER "k_${file}" name)
  get_filename_component(extension "${file}" LAST_EXT)
  string(SUBSTRING "${extension}" 1 -1 extension)
  set(type ${types})
  list(FILTER type INCLUDE REGEX "^${extension}=")
  string(REPLACE "${extension}=" "" type "${type}")
  string(APPEND arrays "const char ${name}[] = {${bytes}};\n")
  string(APPEND entries "      {\"${file}\", \"${type}; charset=utf-8\", {${name}, sizeof(${name})}},\n")
endforeach()
file(WRITE "${output}" "#include \"apps/studio/page.h\"\n\nnamespace circline::apps {\nnamespace {\n
${arrays}
}  // namespace

const std::vector<PageFile>& PageFiles() {
  static const auto* const files = new std::vector<PageFile>{
${entries}  };
  return *files;
}

}  // namespace circline::apps
")
