#!/usr/bin/env python3
"""Stores a network's graph as ONNX Runtime has it once it has made it faster, which it would do at each start.

usage: store_word_network.py IN.onnx OUT.ort

The runtime lies beside OUT.ort. It is packed without headers; its table of functions only grows (OrtApi of onnxruntime_c_api.h).
"""
import ctypes
import pathlib
import sys

API_VERSION, WARNINGS, BASIC = 18, 2, 1
GET_MESSAGE, CREATE_ENVIRONMENT, CREATE_SESSION, CREATE_OPTIONS, SET_OUTPUT, SET_LEVEL = 2, 3, 7, 10, 11, 23
Handle = ctypes.c_void_p


class ApiBase(ctypes.Structure):
    _fields_ = [("get_api", ctypes.CFUNCTYPE(Handle, ctypes.c_uint32)), ("get_version", ctypes.CFUNCTYPE(ctypes.c_char_p))]


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    source, target = sys.argv[1], pathlib.Path(sys.argv[2])
    runtime = ctypes.CDLL(next(target.parent.resolve().glob("libonnxruntime.so*")))
    runtime.OrtGetApiBase.restype = ctypes.POINTER(ApiBase)
    table = ctypes.cast(runtime.OrtGetApiBase().contents.get_api(API_VERSION), ctypes.POINTER(Handle))

    def call(place, types, *arguments):
        status = ctypes.CFUNCTYPE(Handle, *types)(table[place])(*arguments)
        if status:
            message = ctypes.CFUNCTYPE(ctypes.c_char_p, Handle)(table[GET_MESSAGE])(status)
            raise SystemExit(f"{source}: {message.decode()}")

    environment, options, session = Handle(), Handle(), Handle()
    out = ctypes.POINTER(Handle)
    call(CREATE_ENVIRONMENT, (ctypes.c_int, ctypes.c_char_p, out), WARNINGS, b"", ctypes.byref(environment))
    call(CREATE_OPTIONS, (out,), ctypes.byref(options))
    call(SET_LEVEL, (Handle, ctypes.c_int), options, BASIC)
    unfinished = target.with_suffix(".tmp.ort")  # the ending says how it is stored
    call(SET_OUTPUT, (Handle, ctypes.c_char_p), options, bytes(unfinished))
    call(CREATE_SESSION, (Handle, ctypes.c_char_p, Handle, out), environment, source.encode(), options, ctypes.byref(session))
    unfinished.replace(target)


main()
