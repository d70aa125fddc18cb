#if defined(__AVR__) && defined(__AVR_HAVE_MUL__) && defined(__AVR_HAVE_JMP_CALL__)

; Large angles for AVR chips with a hardware multiplier: fraction_of_turn() and turn_to_radian() of
; auvest/math/trigonometry.hpp, bit for bit, in less than half the flash.
;
; A fraction of a turn is r25:r18, in units of 2^-64 turn; floats are in r25:r22.

        .section .progmem.data.auvest_angle, "a", @progbits

; 1/(2 pi) after 24 zero bits, least significant byte first.
digits: .byte   0x7f, 0x10, 0xe4, 0x10, 0x4f, 0x66, 0xa5, 0xd8, 0x36, 0x70, 0x37, 0x4d, 0x7d, 0xf4
        .byte   0xd5, 0x09, 0x7f, 0x4a, 0x05, 0x91, 0x93, 0xdb, 0x60, 0xbe, 0x28, 0x00, 0x00, 0x00
; 2^29 2 pi, of 12 bytes.
two_pi: .byte   0xa2, 0xda, 0x0f, 0xc9, 0, 0, 0, 0, 0, 0, 0, 0

        .section .text.auvest_angle, "ax", @progbits

; r25:r18 = (12 bytes at Z times r25:r22) modulo 2^96, without its four lowest bytes.
multiply:
        push    r16
        push    r17
        movw    r20, r24                ; m = r21:r18
        movw    r18, r22
        clr     r22                     ; r26:r22: what has been added up for the bytes to come
        clr     r23
        clr     r24
        clr     r25
        clr     r17                     ; zero, as r1 has products
        ldi     r16, 12
1:      clr     r26
        lpm     r27, Z+
        mul     r27, r18
        add     r22, r0
        adc     r23, r1
        adc     r24, r17
        adc     r25, r17
        adc     r26, r17
        mul     r27, r19
        add     r23, r0
        adc     r24, r1
        adc     r25, r17
        adc     r26, r17
        mul     r27, r20
        add     r24, r0
        adc     r25, r1
        adc     r26, r17
        mul     r27, r21
        add     r25, r0
        adc     r26, r1
        push    r22                     ; this byte is done
        mov     r22, r23
        mov     r23, r24
        mov     r24, r25
        mov     r25, r26
        dec     r16
        brne    1b
        clr     r1
        pop     r25
        pop     r24
        pop     r23
        pop     r22
        pop     r21
        pop     r20
        pop     r19
        pop     r18
        pop     r0
        pop     r0
        pop     r0
        pop     r0
        pop     r17
        pop     r16
        ret

; Turn fraction_of_turn(float x), finite x >= 0.5

        .global auvest_fraction_of_turn
        .type   auvest_fraction_of_turn, @function
auvest_fraction_of_turn:
        lsl     r24
        rol     r25                     ; the exponent
        sec
        ror     r24                     ; the mantissa: r24:r22
        subi    r25, 126                ; the first digit needed
        ldi     r30, lo8(digits + 16)
        ldi     r31, hi8(digits + 16)
        mov     r18, r25
        lsr     r18
        lsr     r18
        lsr     r18
        sub     r30, r18
        sbc     r31, r1
        mov     r18, r25
        andi    r18, 7
        clr     r25
        rjmp    3f
2:      lsl     r22
        rol     r23
        rol     r24
        rol     r25
3:      subi    r18, 1
        brcc    2b
        rjmp    multiply

; float turn_to_radian(Turn turn), not zero

        .global auvest_turn_to_radian
        .type   auvest_turn_to_radian, @function
auvest_turn_to_radian:
        bst     r25, 7                  ; the sign
        brtc    4f
        com     r18
        com     r19
        com     r20
        com     r21
        com     r22
        com     r23
        com     r24
        com     r25
4:      ldi     r26, 128                ; exponent of 2^-1 turn = pi rad, less one
5:      tst     r25
        brmi    6f
        lsl     r18
        rol     r19
        rol     r20
        rol     r21
        rol     r22
        rol     r23
        rol     r24
        rol     r25
        dec     r26
        rjmp    5b
6:      push    r26
        ldi     r30, lo8(two_pi)
        ldi     r31, hi8(two_pi)
        rcall   multiply
        pop     r26
        tst     r21                     ; the leading one is bit 31 or 30
        brmi    7f
        lsl     r18
        rol     r19
        rol     r20
        rol     r21
        dec     r26
7:      lsl     r18                     ; round
        adc     r19, r1
        adc     r20, r1
        adc     r21, r1
        brcc    8f
        subi    r26, -2                 ; 1.11..1 became 10.0
8:      lsl     r21                     ; the hidden bit counts as one more
        adc     r26, r1
        lsr     r26
        ror     r21
        bld     r26, 7
        mov     r22, r19
        mov     r23, r20
        mov     r24, r21
        mov     r25, r26
        ret

#endif
