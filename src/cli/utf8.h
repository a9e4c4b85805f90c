/* Names from files and of files in JSON, XML and HTML, which are UTF-8, whatever bytes they are. */
#ifndef CLI_UTF8_H
#define CLI_UTF8_H

#include <jansson.h>
#include <stddef.h>

/* What stands for a byte that is part of no character: U+FFFD. */
#define CLI_NO_CHARACTER "\xef\xbf\xbd"

/* Bytes of the character that a text begins with; 0 where it is none of UTF-8's, or none that XML takes. */
size_t cli_utf8_length(const char *text);

/* A JSON string, with CLI_NO_CHARACTER for each byte of no character; NULL where memory is short. */
json_t *cli_utf8_json(const char *text);

#endif
