#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the files in nifti/, metaimage/ and vti/ by stock software: Debian's python3-nibabel and python3-vtk9.

Each volume has 3 x 4 x 5 samples; sample i, x fastest, of frame t is (7 i + 13 t) mod 100 (minus 50 where the
type has a sign). tests/io/stock_test.cc knows that.
"""
import os

import nibabel
import numpy
import vtk
from vtk.util import numpy_support

os.chdir(os.path.dirname(os.path.abspath(__file__)))
TYPES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]


def samples(dtype, frame=0):
    values = (7 * numpy.arange(60) + 13 * frame) % 100
    return (values if dtype.startswith("u") else values - 50).astype(dtype)


def volume(dtype, frame=0):
    return samples(dtype, frame).reshape((3, 4, 5), order="F")


def nifti():
    oblique = numpy.array([[0, -2, 0, 10], [1.5, 0, 0, -20], [0, 0, 2.5, 30], [0, 0, 0, 1]])
    image = nibabel.Nifti1Image(volume("int16"), oblique)
    image.header.set_slope_inter(0.5, -3)
    image.header.set_xyzt_units("mm", "sec")
    nibabel.save(image, "nifti/scaled.nii.gz")
    header = nibabel.Nifti2Header(endianness=">")
    header.set_data_dtype("uint8")
    frames = numpy.stack([volume("uint8", t) for t in range(3)], axis=3)
    image = nibabel.Nifti2Image(frames, None, header)
    image.set_qform(oblique, code=1)
    image.set_sform(None, code=0)
    image.header.set_xyzt_units("mm", "msec")
    image.header["pixdim"][4] = 40
    image.header["toffset"] = 1000
    nibabel.save(image, "nifti/frames.nii")
    nibabel.save(nibabel.Nifti1Image(frames, None), "nifti/frames.nii.gz")  # no unit of time
    nibabel.save(nibabel.Nifti1Pair(volume("float32"), oblique), "nifti/pair.hdr")
    for dtype in ["int32", "float64"]:
        nibabel.save(nibabel.Nifti1Image(volume(dtype), oblique, dtype=dtype), f"nifti/{dtype}.nii")


def image_data(dtypes, frame=0, first=(0, 0, 0)):
    image = vtk.vtkImageData()
    image.SetExtent(first[0], first[0] + 2, first[1], first[1] + 3, first[2], first[2] + 4)
    image.SetOrigin(10, -20, 30)
    image.SetSpacing(1.5, 2, 2.5)
    for dtype in dtypes:
        array = numpy_support.numpy_to_vtk(samples(dtype, frame), deep=True)
        array.SetName(dtype)
        image.GetPointData().AddArray(array)
    image.GetPointData().SetScalars(image.GetPointData().GetArray(dtypes[0]))
    return image


def metaimage():
    for name, dtype, compressed in [("short.mhd", "int16", False), ("short.mha", "int16", True),
                                    ("double.mha", "float64", False), ("packed.mhd", "uint8", True)]:
        writer = vtk.vtkMetaImageWriter()
        writer.SetFileName("metaimage/" + name)
        writer.SetInputData(image_data([dtype]))
        writer.SetCompression(compressed)
        writer.Write()


def vti():
    def write(name, image, mode, compressor=None, wide=False, big=False, base64=False):
        writer = vtk.vtkXMLImageDataWriter()
        writer.SetFileName(f"vti/{name}.vti")
        writer.SetInputData(image)
        getattr(writer, f"SetDataModeTo{mode}")()
        if compressor is None:
            writer.SetCompressorTypeToNone()
        else:
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            writer.SetBlockSize(128)  # several blocks to an array
        (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
        writer.SetEncodeAppendedData(base64)
        writer.Write()

    every = image_data(TYPES)
    write("ascii", every, "Ascii")
    write("binary", every, "Binary")
    write("binary_zlib_wide", every, "Binary", "ZLib", wide=True)
    write("binary_wide_big", every, "Binary", wide=True, big=True)
    write("appended", every, "Appended")
    write("appended_zlib_big", every, "Appended", "ZLib", big=True)
    write("appended_base64", every, "Appended", base64=True)
    write("appended_base64_zlib_wide", every, "Appended", "ZLib", wide=True, base64=True)
    write("lz4", image_data(["uint8"]), "Appended", "LZ4")
    write("lzma", image_data(["uint8"]), "Appended", "LZMA")
    turned = image_data(["float32"], first=(4, -2, 7))
    turned.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    vectors = numpy_support.numpy_to_vtk(numpy.zeros((60, 3), "float32"), deep=True)
    vectors.SetName("velocity")
    turned.GetPointData().AddArray(vectors)
    cells = numpy_support.numpy_to_vtk(numpy.zeros(24, "float32"), deep=True)
    cells.SetName("pressure")
    turned.GetCellData().AddArray(cells)
    write("turned", turned, "Appended", "ZLib")
    turned.GetPointData().Initialize()
    write("cells", turned, "Ascii")
    for t in range(3):
        image = image_data(["float32"], t)
        time = numpy_support.numpy_to_vtk(numpy.array([0.1 * t]), deep=True)
        time.SetName("TimeValue")
        image.GetFieldData().AddArray(time)
        write(f"time_{8 + t}", image, "Appended", "ZLib")


nifti()
metaimage()
vti()
