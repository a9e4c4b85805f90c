# Pages of docs that `vdbshade help TOPIC` prints, as arrays, and the man page.
set(VSH_HELP_PAGES ${PROJECT_BINARY_DIR}/help_pages.c)
file(GLOB VSH_HELP_TEXTS CONFIGURE_DEPENDS docs/*.md)
list(FILTER VSH_HELP_TEXTS EXCLUDE REGEX "/(architecture|README).md$") # for developers; an index of links
string(REPLACE ";" "," pages "${VSH_HELP_TEXTS}")
add_custom_command(OUTPUT ${VSH_HELP_PAGES}
                   COMMAND ${CMAKE_COMMAND} -DOUT=${VSH_HELP_PAGES} "-DPAGES=${pages}" -P ${PROJECT_SOURCE_DIR}/cmake/embed_docs.cmake
                   DEPENDS cmake/embed_docs.cmake ${VSH_HELP_TEXTS} VERBATIM)
add_library(vdbshade_help_pages OBJECT ${VSH_HELP_PAGES}) # for every target made of the command line's sources
vsh_set_source_flags(vdbshade_help_pages)
target_include_directories(vdbshade_help_pages PRIVATE src include)

configure_file(cmake/vdbshade.1.in vdbshade.1 @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/vdbshade.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
