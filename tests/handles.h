/*
 * How many handles of HDF5 and descriptors are open, so that a test sees those that are
 * left. HDF5 frees them at its end, and no leak checker would know of them.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef TESTS_HANDLES_H
#define TESTS_HANDLES_H

#include <dirent.h>
#include <stddef.h>

#include <hdf5.h>

/* Numbers of one kind follow each other below the bits that say which: all before this
 * one. Takes and closes it. */
static int handles_before(hid_t last, herr_t (*close)(hid_t))
{
    const hid_t number = last & (((hid_t)1 << 56) - 1);
    int count = 0;
    for (hid_t id = last - number; id < last; id++)
        count += H5Iis_valid(id) > 0;
    close(last);
    return count;
}

static int handles_open(void)
{
    int count = handles_before(H5Screate(H5S_NULL), H5Sclose) +
                handles_before(H5Pcreate(H5P_FILE_ACCESS), H5Pclose) +
                handles_before(H5Tcopy(H5T_NATIVE_INT), H5Tclose);
    count += (int)H5Fget_obj_count((hid_t)H5F_OBJ_ALL, H5F_OBJ_ALL);
    DIR *descriptors = opendir("/proc/self/fd"); /* itself always one of them */
    while (descriptors && readdir(descriptors))
        count++;
    if (descriptors)
        closedir(descriptors);
    return count;
}

#endif
