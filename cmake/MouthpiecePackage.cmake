# What a package holds besides programs and data: man pages and shell completions, made by the programs themselves; and
# `make deb` (CPack). The headers and libraries are a component of their own, which the package leaves out.
find_package(Python3 COMPONENTS Interpreter QUIET)
if(Python3_FOUND)
  set(command_docs ${CMAKE_BINARY_DIR}/command_docs)
  add_custom_target(command_docs
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/tools/command_docs.py $<TARGET_FILE:synth> $<TARGET_FILE:corpus>
            $<TARGET_FILE:retarget> --out ${command_docs}
    DEPENDS synth corpus retarget COMMENT "Writing man pages and completions" VERBATIM)
  install(DIRECTORY ${command_docs}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} OPTIONAL)
  install(DIRECTORY ${command_docs}/bash/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions OPTIONAL)
  install(DIRECTORY ${command_docs}/zsh/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions OPTIONAL)
  install(DIRECTORY ${command_docs}/fish/ DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d OPTIONAL)
endif()
set(doc ${CMAKE_INSTALL_DATADIR}/doc/mouthpiece)
install(FILES README.md CHANGELOG.md DESTINATION ${doc})
install(FILES LICENSE DESTINATION ${doc} RENAME copyright)
install(DIRECTORY docs DESTINATION ${doc})  # as README names them
install(DIRECTORY examples DESTINATION ${doc})
install(DIRECTORY blender/mouthpiece DESTINATION ${CMAKE_INSTALL_DATADIR}/mouthpiece/blender PATTERN __pycache__ EXCLUDE)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mouthpiece)
set(CPACK_PACKAGE_CONTACT "Mouthpiece maintainers <maintainers@mouthpiece.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "speaking faces from motion capture")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)
set(CPACK_COMPONENTS_ALL programs)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME mouthpiece)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What the programs start, load or read while they run: voices, and the acoustic model of the aligner.
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS
  "festival, festvox-us-slt-hts, festvox-kallpc16k, libflite1, libespeak-ng1, espeak-ng-data, libpocketsphinx3, pocketsphinx-en-us")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "nodejs")  # recordings without their words are heard better with it
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "ffmpeg, blender, mecab, open-jtalk-mecab-naist-jdic")
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION
  "Mouthpiece makes a face speak with movements learnt and taken from motion capture: a line,\n a recording or a song in; a moving face, sound and curves for animation programs out.\n A sample corpus and face are part of it.")
include(CPack)
