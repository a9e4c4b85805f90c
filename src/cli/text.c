#include "text.h"

#include <string.h>

int cli_text_characters(const char *text, size_t length) {
    int count = 0;
    for (size_t i = 0; i < length; ++i) {
        count += ((unsigned char)text[i] & 0xc0) != 0x80;
    }
    return count;
}

void cli_text_add(cli_text *text, const char *words) {
    static const char blanks[] = " \n";
    for (words += strspn(words, blanks); *words != '\0'; words += strspn(words, blanks)) {
        const size_t length = strcspn(words, blanks);
        const int wide = cli_text_characters(words, length);
        if (text->column > 0 && text->column + 1 + wide > text->width) {
            cli_text_end(text);
        }
        const int first = text->column == 0;
        if (first) {
            fprintf(text->out, "%*s", text->lead, "");
            text->lead = text->indent;
        } else {
            fputc(' ', text->out);
        }
        if (text->put != NULL) {
            text->put(text->out, words, (int)length, first);
        } else {
            fwrite(words, 1, length, text->out);
        }
        text->column += wide + !first;
        words += length;
    }
}

void cli_text_end(cli_text *text) {
    if (text->column > 0) {
        fputc('\n', text->out);
    }
    text->column = 0;
}
