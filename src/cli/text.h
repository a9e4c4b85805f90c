/* Running text, broken into lines at blanks. */
#ifndef CLI_TEXT_H
#define CLI_TEXT_H

#include <stdio.h>

typedef struct cli_text {
    FILE *out;
    int width;                                                       /* characters a line, if words allow */
    int lead;                                                        /* blanks before the first line */
    int indent;                                                      /* blanks before each later line */
    void (*put)(FILE *out, const char *word, int length, int first); /* NULL: as it is; first of a line */
    int column;                                                      /* 0 to begin with */
} cli_text;

/* Counts the characters of UTF-8 text. */
int cli_text_characters(const char *text, size_t length);

/* Adds words that blanks or newlines part. */
void cli_text_add(cli_text *text, const char *words);

/* Ends the line, where one was begun. */
void cli_text_end(cli_text *text);

#endif
