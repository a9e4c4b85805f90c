/* Outputs that are a file for each object (--per-object). */
#ifndef CLI_OBJECT_OUTPUT_H
#define CLI_OBJECT_OUTPUT_H

/* What stands in an output's path for the name of its object. */
#define CLI_OBJECT_NAME "%s"

/* OUT as a path with CLI_OBJECT_NAME in it: "out/", a folder that is there and "out" (without an ending)
 * become out/%s.exr, out.png becomes out.%s.png. To be freed; NULL where memory was short. */
char *cli_object_output(const char *output);

/* The folder that such a path's files go to, to be freed; NULL where memory was short. */
char *cli_object_folder(const char *path);

#endif
