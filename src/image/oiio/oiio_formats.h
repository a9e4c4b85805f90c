// Which formats are written and read, and what each can hold.
#pragma once

#include "image/oiio.h"

#include <string>

namespace vshi {

// Functions of the module's table.
bool find_format(const char *path, vshi_format *format);
const char *refusal_of(const char *path);
vsh_result read_image(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                      vsh_image_file **file, vsh_error *error);

// Lower case, without the dot.
std::string ending_of(const char *path);

// OpenImageIO's name of the format with this ending, "tiff" for "tif"; "" for none.
std::string format_of_ending(const std::string &ending);

bool is_readable(const std::string &name);

// Rows that are handed over at a time.
int rows_of_band(int64_t width, int64_t height, int64_t count);

} // namespace vshi
