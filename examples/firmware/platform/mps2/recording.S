// The recording, in a section of its own.
    .section .recording, "a"
    .balign 8
    .global recording_begin, recording_end
recording_begin:
    .incbin RECORDING
recording_end:
