/* Files from strangers, parsed where they can do no harm: the program behind vsh_run.reader.
 *
 * A call with a reader starts that program for each file, and waits. The child takes limits on itself before
 * it opens the file: address space (run->memory_limit and 2 GiB for the program itself; the machine's memory
 * where there is no limit), processor time, no core dump, few descriptors, no new privileges, no longer life
 * than its parent's, and, where the host allows it, a filter of system calls (seccomp) in all of its threads,
 * each looked at, that leaves reading files, memory and threads of its own: no sockets, no other program, no
 * file opened for writing, no signal
 * to others. It parses, and writes arrays into memory that the caller handed it. When it has ended the caller
 * seals that memory and takes nothing of it for granted: sizes, counts, indices, finite values, transforms,
 * order and alignment of leaves, ends of strings; then come the same checks as without a reader.
 *
 * - A crash is VSH_ERROR_READ ("PATH: damaged: the reader crashed (SIGSEGV)"), a file that takes longer than
 *   run->reader_seconds or more memory than the limit VSH_ERROR_LIMIT.
 * - The progress callback is called about every 20 ms while the reader runs; to cancel kills it at once.
 * - What comes out is the same to the bit as without a reader.
 * - Sanitized builds have neither the limit on the address space nor the filter.
 *
 * Not promised: that the reader cannot read other files of the user (models name files beside them), or that
 * what a file shows is right. Scene files, lists of spheres and points are parsed in this process always, by
 * code of ours and Jansson. docs/reliability.md has what it costs and what was tried. */
#ifndef VDBSHADE_READER_H
#define VDBSHADE_READER_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A reader's only argument. */
#define VSH_READER_ARGUMENT "--vdbshade-reader"

/* For the main of a reader, before anything else, and in a process with one thread: where argv[1] is
 * VSH_READER_ARGUMENT, limits the process for good, parses the file that the parent asks for and returns the
 * exit code that main is to return; -1 where the argument is not there, which is a common start. A program
 * can so be its own reader ("/proc/self/exe"). Any vdbshade of the same version is one, too. */
VSH_API int32_t vsh_reader_serve(int argc, char **argv);

#ifdef __cplusplus
}
#endif
#endif
