/* Point files of every format: read in small batches, kept or not, and written with answers beside them, as
 * the query command does. The first byte chooses the formats and options. A file that is written in full must
 * be read again without another bad row. */
#include "fuzz.h"

#include "cli/query/points.h"

enum { ROWS = 7, MOST_KEPT = 256 };

static int copy(cli_points_reader *reader, int32_t format, bool answers_only, const char *to) {
    const bool keep = !answers_only && format == reader->table.format && cli_points_can_keep(reader);
    char names[2][80] = {"shadow.fuzz", "fuzz"};
    float values[2 * ROWS] = {1.0f, 0.5f, 1e-30f};
    const cli_points_answers answers = {names, values, 2};
    cli_points points = cli_points_create(ROWS, reader->has_normals, keep);
    cli_points_writer writer = {0};
    int code = cli_points_writer_open(to, format, answers_only, reader, &answers, &writer);
    while (code == CLI_OK) {
        code = cli_points_read(reader, MOST_KEPT, &points);
        if (code != CLI_OK || points.count == 0) {
            break;
        }
        code = cli_points_write(&writer, &points);
    }
    code = code == CLI_OK ? cli_points_writer_commit(&writer, reader) : code;
    cli_points_writer_free(&writer);
    cli_points_free(&points);
    return code;
}

static void read_back(const char *path, int32_t format, const cli_points_reader *written) {
    fuzz_run(); /* starts the time again */
    cli_points_reader reader;
    int code = cli_points_open(path, format, -1, false, &reader);
    cli_points points = cli_points_create(ROWS, reader.has_normals, false);
    while (code == CLI_OK) {
        code = cli_points_read(&reader, MOST_KEPT, &points);
        if (points.count == 0) {
            break;
        }
    }
    if (code != CLI_INTERRUPTED &&
        (code != CLI_OK || reader.table.rows != written->table.rows || reader.bad > written->bad)) {
        fprintf(stderr, "fuzz: written %d rows, %d bad; read %d, %d bad; code %d\n", (int)written->table.rows,
                (int)written->bad, (int)reader.table.rows, (int)reader.bad, code);
        abort();
    }
    cli_points_free(&points);
    cli_points_close(&reader);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) {
        return 0;
    }
    fuzz_run(); /* starts the time */
    const int32_t from = data[0] % 3, to = data[0] / 3 % 3;
    const int normals = data[0] / 9 % 3 - 1;
    const bool strict = data[0] / 27 % 2 != 0, answers_only = data[0] / 54 % 2 != 0;
    char output[512];
    snprintf(output, sizeof output, "%s/out", fuzz_folder());
    cli_points_reader reader;
    int code = cli_points_open(fuzz_file("in", data + 1, size - 1), from, normals, strict, &reader);
    code = code == CLI_OK ? copy(&reader, to, answers_only, output) : code;
    FUZZ_REQUIRE(code == CLI_OK || code == CLI_USAGE || code == CLI_FILE || code == CLI_LIMIT ||
                 code == CLI_INTERRUPTED);
    if (code == CLI_OK && !answers_only && from != to && to != VSHI_TABLE_RAW) {
        read_back(output, to, &reader);
    }
    cli_points_close(&reader);
    return 0;
}
