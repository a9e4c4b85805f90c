/* Man pages in the man macros (man(7)), one of the program and one of each command. There is no date: the
 * same build gives the same page. */
#include "commands.h"
#include "message.h"

#include <limits.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

enum { WIDTH = 56 }; /* and what escapes add to it: lines stay below 80 bytes */

/* Writes a word as roff takes it literally. Dashes are minus signs, which can be copied. */
static void put_word(FILE *out, const char *word, int length, int first) {
    if (first && (word[0] == '.' || word[0] == '\'')) {
        fputs("\\&", out);
    }
    for (int i = 0; i < length; ++i) {
        if (word[i] == '\\' || word[i] == '-') {
            fputs(word[i] == '-' ? "\\-" : "\\e", out);
        } else {
            fputc(word[i], out);
        }
    }
}

static void write_paragraph(FILE *out, const char *words) {
    cli_text text = {.out = out, .width = WIDTH, .put = put_word};
    cli_text_add(&text, words);
    cli_text_end(&text);
}

static void put_in_font(FILE *out, char font, const char *word, int length) {
    fprintf(out, "\\f%c", font);
    put_word(out, word, length, 0);
    fputs("\\fR", out);
}

static void write_title(FILE *out, const char *name) {
    fprintf(out, ".\\\" Made by 'vdbshade help --man'.\n.TH ");
    for (const char *c = name; *c != '\0'; ++c) {
        fputc(*c >= 'a' && *c <= 'z' ? *c - 'a' + 'A' : *c, out);
    }
    fprintf(out, " 1 \"\" \"vdbshade %s\" \"vdbshade\"\n", vsh_version());
}

static void write_option(FILE *out, const cli_option *option) {
    fputs(".TP\n", out);
    if (option->key < 256) {
        fprintf(out, "\\fB\\-%c\\fR, ", option->key);
    }
    char name[72];
    snprintf(name, sizeof name, "--%s", option->name);
    put_in_font(out, 'B', name, (int)strlen(name));
    if (option->value != NULL) {
        fputc(' ', out);
        put_in_font(out, 'I', option->value, (int)strlen(option->value));
    }
    fputc('\n', out);
    write_paragraph(out, option->help);
}

/* Options are bold, placeholders in italics. */
static void put_usage(FILE *out, const char *word, int length, int first) {
    (void)first;
    put_in_font(out, word[0] == '-' ? 'B' : 'I', word, length);
}

/* Writes " INPUT -o OUT [options]". */
static void write_usage(FILE *out, const char *usage) {
    cli_text text = {.out = out, .width = INT_MAX, .lead = 1, .put = put_usage};
    cli_text_add(&text, usage);
    cli_text_end(&text);
}

static void write_exit_codes(FILE *out) {
    fputs(".SH EXIT STATUS\n", out);
    for (const cli_exit_row *exit = cli_exits; exit->meaning != NULL; ++exit) {
        fprintf(out, ".TP\n\\fB%d\\fR\n", exit->code);
        write_paragraph(out, exit->meaning);
    }
    fputs(".PP\n", out);
    write_paragraph(out, cli_errors);
}

/* The other pages. */
static void write_see_also(FILE *out, const cli_command *command) {
    fputs(command != NULL ? ".SH SEE ALSO\n.BR vdbshade (1)" : ".SH SEE ALSO", out);
    size_t listed = command != NULL;
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        if (row->command != command) {
            fprintf(out, "%s\n.BR vdbshade\\-%s (1)", listed++ > 0 ? "," : "", row->command->name);
        }
    }
    fputc('\n', out);
    fputs(".PP\n", out);
    write_paragraph(out, "'vdbshade help' lists the pages of the manual.");
}

static void write_program(FILE *out) {
    write_title(out, "vdbshade");
    fputs(".SH NAME\nvdbshade \\- soft shadows and ambient occlusion from signed distance fields\n"
          ".SH SYNOPSIS\n\\fBvdbshade\\fR \\fICOMMAND\\fR ...\n.br\n"
          "\\fBvdbshade\\fR \\fICOMMAND\\fR \\fB\\-\\-help\\fR\n.br\n\\fBvdbshade \\-\\-version\\fR\n.SH "
          "DESCRIPTION\n",
          out);
    write_paragraph(out, cli_summary);
    fputs(".SH COMMANDS\n", out);
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        fprintf(out, ".TP\n\\fB%s\\fR", row->command->name);
        write_usage(out, row->operands);
        write_paragraph(out, row->brief);
    }
    write_exit_codes(out);
    write_see_also(out, NULL);
}

void cli_write_man(FILE *out, const cli_command_row *row) {
    if (row == NULL) {
        write_program(out);
        return;
    }
    const cli_command *command = row->command;
    char name[64];
    snprintf(name, sizeof name, "vdbshade-%s", command->name);
    write_title(out, name);
    fprintf(out, ".SH NAME\nvdbshade\\-%s \\-\n", command->name);
    write_paragraph(out, row->brief);
    fprintf(out, ".SH SYNOPSIS\n\\fBvdbshade %s\\fR", command->name);
    write_usage(out, command->usage);
    fputs(".SH DESCRIPTION\n", out);
    write_paragraph(out, command->summary);
    fputs(".SH OPTIONS\n", out);
    cli_option options[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, options, CLI_MOST_OPTIONS);
    for (size_t i = 0; i < count; ++i) {
        if (options[i].key != 0) {
            write_option(out, &options[i]);
        } else {
            fputs(".SS ", out);
            write_paragraph(out, options[i].help);
        }
    }
    write_exit_codes(out);
    write_see_also(out, command);
}
