#if defined(__AVR__) && defined(__AVR_HAVE_MUL__) && defined(__AVR_HAVE_JMP_CALL__)

; Multiplication, addition and subtraction of floats for AVR chips with a hardware multiplier: the
; bits of avr-libc's own, in three quarters of the cycles.
;
; The linker takes these in place of avr-libc's __mulsf3, __addsf3 and __subsf3. Here are only normal
; operands with a normal result, rounded to nearest, ties to even; zeros, subnormals, infinities, NaN
; and results near the ends of the range go to avr-libc. Arguments and result as avr-gcc has them:
; A in r25:r22, B in r21:r18, result in r25:r22; r0, r18-r27, r30, r31 and T may change, r1 is zero.
        .text                           ; before .text.*, where gcc puts what is hot

; ---- A * B ----

multiply_by_library:
        call    __mulsf3x
        jmp     __fp_round

        .global __mulsf3
        .type   __mulsf3, @function
__mulsf3:
        ; Exponents: r26 of A, r30 of B; 0 and 255 are not for us.
        mov     r26, r25
        mov     r27, r24
        lsl     r27
        rol     r26
        breq    multiply_by_library
        cpi     r26, 0xff
        breq    multiply_by_library
        mov     r30, r21
        mov     r27, r20
        lsl     r27
        rol     r30
        breq    multiply_by_library
        cpi     r30, 0xff
        breq    multiply_by_library
        ; r27:r26 = that of the product, if its mantissa is below 2: 1..253 is for us.
        clr     r27
        add     r26, r30
        adc     r27, r1
        subi    r26, 127
        sbci    r27, 0
        tst     r27                     ; (sbci leaves Z clear if r26 is not 0)
        brne    multiply_by_library
        cpi     r26, 254
        brsh    multiply_by_library
        tst     r26
        breq    multiply_by_library
        ; Sign to T, hidden bits in place.
        eor     r25, r21
        bst     r25, 7
        ori     r24, 0x80
        ori     r20, 0x80
        ; r18:r22:r31:r30:r27:r21 = (r24:r23:r22) * (r20:r19:r18), 48 bits.
        clr     r25
        mul     r22, r18
        mov     r21, r0
        mov     r27, r1
        mul     r22, r20
        movw    r30, r0
        mul     r22, r19
        add     r27, r0
        adc     r30, r1
        adc     r31, r25
        clr     r22
        mul     r23, r18
        add     r27, r0
        adc     r30, r1
        adc     r31, r25
        mul     r24, r18
        add     r30, r0
        adc     r31, r1
        adc     r22, r25
        clr     r18
        mul     r23, r19
        add     r30, r0
        adc     r31, r1
        adc     r22, r25
        mul     r23, r20
        add     r31, r0
        adc     r22, r1
        adc     r18, r25
        mul     r24, r19
        add     r31, r0
        adc     r22, r1
        adc     r18, r25
        mul     r24, r20
        add     r22, r0
        adc     r18, r1
        clr     r1
        ; The leading one is bit 47, or bit 46: then shift.
        tst     r18
        brmi    1f
        lsl     r27
        rol     r30
        rol     r31
        rol     r22
        rol     r18
        dec     r26
1:      inc     r26
        ; Mantissa r18:r22:r31; the half is bit 7 of r30, below it r30:r27:r21.
        lsl     r30
        brcc    3f
        or      r27, r21
        or      r27, r30
        brne    2f
        sbrs    r31, 0
        rjmp    3f
2:      subi    r31, 0xff
        sbci    r22, 0xff
        sbci    r18, 0xff
        brcs    3f
        inc     r26                     ; 1.11..1 became 10.0
3:      lsl     r18                     ; the hidden bit out, the last bit of the exponent in
        lsr     r26
        ror     r18
        bld     r26, 7
        mov     r23, r22
        mov     r22, r31
        mov     r24, r18
        mov     r25, r26
        ret
        .size   __mulsf3, . - __mulsf3

; ---- A - B, A + B ----

add_by_library:
        clr     r27
        clr     r26
        call    __addsf3x
        jmp     __fp_round

        .global __subsf3
        .type   __subsf3, @function
__subsf3:
        subi    r21, 0x80
        .global __addsf3
        .type   __addsf3, @function
__addsf3:
        ; Exponents: r27 of A, r31 of B.
        mov     r30, r24
        lsl     r30
        mov     r27, r25
        rol     r27
        breq    add_by_library
        cpi     r27, 0xff
        breq    add_by_library
        mov     r30, r20
        lsl     r30
        mov     r31, r21
        rol     r31
        breq    add_by_library
        cpi     r31, 0xff
        breq    add_by_library
        ; Make A the larger in size. (Of the mantissas only the last 23 bits may be compared: the
        ; eighth bit of r24 and r20 belongs to the exponents, which decide before it does.)
        cp      r22, r18
        cpc     r23, r19
        cpc     r24, r20
        cpc     r27, r31
        brsh    1f
        movw    r0, r22
        movw    r22, r18
        movw    r18, r0
        movw    r0, r24
        movw    r24, r20
        movw    r20, r0
        mov     r0, r27
        mov     r27, r31
        mov     r31, r0
        clr     r1
1:      cpi     r27, 32                 ; cancellation of 24 bits leaves a normal number
        brlo    add_by_library
        mov     r26, r27
        sub     r26, r31
        cpi     r26, 26
        brlo    2f
        ret                             ; B is below half of A's last place: A stays
2:      bst     r25, 7                  ; sign of the result; r25 says whether the signs differ
        eor     r25, r21
        ori     r24, 0x80
        ori     r20, 0x80
        ; B >> r26: mantissa r20:r19:r18, guard byte r21, sticky r30.
        clr     r21
        clr     r30
3:      cpi     r26, 8
        brlo    4f
        or      r30, r21
        mov     r21, r18
        mov     r18, r19
        mov     r19, r20
        clr     r20
        subi    r26, 8
        rjmp    3b
4:      subi    r26, 1
        brcs    5f
        ; By 1 to 7 bits: times r31 = 2^(8 - bits), and the upper byte of each product.
        ldi     r31, 0x80
        sbrc    r26, 1
        ldi     r31, 0x20
        sbrc    r26, 0
        lsr     r31
        sbrc    r26, 2
        swap    r31
        mul     r21, r31
        or      r30, r0
        mov     r21, r1
        mul     r18, r31
        or      r21, r0
        mov     r18, r1
        mul     r19, r31
        or      r18, r0
        mov     r19, r1
        mul     r20, r31
        or      r19, r0
        mov     r20, r1
        clr     r1
5:      sbrc    r25, 7
        rjmp    20f
        ; Same signs.
        add     r22, r18
        adc     r23, r19
        adc     r24, r20
        brcc    10f
        ror     r24
        ror     r23
        ror     r22
        ror     r21
        brcc    6f
        ori     r30, 1
6:      inc     r27
        cpi     r27, 0xff
        brne    10f
        clr     r24                     ; infinity
        clr     r23
        clr     r22
        rjmp    12f
        ; Different signs: A - B, from the sticky byte up.
20:     neg     r30
        ldi     r26, 0
        sbc     r26, r21
        mov     r21, r26
        sbc     r22, r18
        sbc     r23, r19
        sbc     r24, r20
        tst     r24
        brmi    10f
        brne    22f
        cpi     r23, 0
        brne    21f
        mov     r26, r22
        or      r26, r21
        breq    30f
21:     mov     r24, r23                ; by whole bytes
        mov     r23, r22
        mov     r22, r21
        clr     r21
        subi    r27, 8
        tst     r24
        breq    21b
        brmi    10f
22:     lsl     r21                     ; by bits
        rol     r22
        rol     r23
        rol     r24
        dec     r27
        tst     r24
        brpl    22b
        ; Round: the half is bit 7 of the guard byte.
10:     lsl     r21
        brcc    12f
        or      r21, r30
        brne    11f
        sbrs    r22, 0
        rjmp    12f
11:     subi    r22, 0xff
        sbci    r23, 0xff
        sbci    r24, 0xff
        brcs    12f
        inc     r27
12:     lsl     r24
        lsr     r27
        ror     r24
        bld     r27, 7
        mov     r25, r27
        ret
30:     clr     r25                     ; A - A = +0
        clr     r24
        clr     r23
        clr     r22
        ret
        .size   __addsf3, . - __addsf3
#endif
