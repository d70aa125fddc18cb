#if defined(__AVR__) && defined(__AVR_HAVE_MUL__) && defined(__AVR_HAVE_JMP_CALL__) && \
    !defined(AUVEST_NO_AVR_FLOAT)

; Float arithmetic for AVR chips with a hardware multiplier: A + B, A - B, A * B, A / B and the root
; of A, rounded as IEEE 754 says, to nearest and ties to even, with signed zeros, subnormal numbers,
; infinities and NaN. The linker takes these routines in place of avr-libc's, which are larger and,
; but for the root, slower, and which round subnormal quotients down. All share one end, and all but
; the sum one beginning.
;
; With AUVEST_NO_AVR_FLOAT defined for the assembler, nothing is left of this file and avr-libc's are
; taken: where another library has routines of the same names.
;
; The contract, that of avr-gcc's calls:
;
;   routine        computes          A         B         result
;   __addsf3       A + B             r25:r22   r21:r18   r25:r22
;   __subsf3       A - B             r25:r22   r21:r18   r25:r22
;   __mulsf3       A * B             r25:r22   r21:r18   r25:r22
;   __divsf3       A / B             r25:r22   r21:r18   r25:r22
;   sqrt, sqrtf    the root of A     r25:r22   -         r25:r22
;
;   register                         who
;   r18-r27, r30, r31, r0            the routine may change them
;   r1                               zero at the call and at the return; other values between: an
;                                    interrupt saves and clears it, as avr-gcc's do
;   r2-r17, r28, r29                 as they were
;   SREG                             the routine may change T and the flags of arithmetic, not I
;   stack                            the return address only: nothing is pushed, nothing called
;   memory                           neither read nor written: safe in an interrupt

        .text                           ; before .text.*, where gcc puts what is hot

; ---- Operands ----

        .global __divsf3
        .type   __divsf3, @function
__divsf3:
        ldi     r27, 0x80
        rjmp    unpack

        .global sqrt
        .type   sqrt, @function
        .global sqrtf
        .type   sqrtf, @function
sqrt:
sqrtf:
        ldi     r27, 0xa0
        ldi     r21, 0x3f               ; at first as A / 1
        ldi     r20, 0x80
        rjmp    unpack

1:      set                             ; special A: zero or subnormal, infinite or NaN
        breq    3f
        clr     r25
        rjmp    3f
2:      set                             ; special B
        breq    4f
        clr     r21
        rjmp    4f

        .global __mulsf3
        .type   __mulsf3, @function
__mulsf3:
        ldi     r27, 1
; What each operation (r27: 0 add, 1 multiply, 0x80 divide, 0xa0 root) starts from:
; - A's exponent - 1 in r25, its mantissa with the hidden bit in r24:r22; B's in r21 and r20:r18.
;   A subnormal number and zero have the exponent of the smallest normal ones and no hidden bit,
;   infinity and NaN have 254 and none;
; - the sign of A in bit 7 of r31, that of A * B in bit 7 of r30;
; - T if A or B is special.
unpack:
        clt
        mov     r31, r25
        mov     r30, r25
        eor     r30, r21
        lsl     r24
        rol     r25
        dec     r25
        cpi     r25, 254                ; C: a normal number's hidden bit
        brsh    1b
3:      ror     r24
        lsl     r20
        rol     r21
        dec     r21
        cpi     r21, 254
        brsh    2b
4:      ror     r20
        brts    5f
        sbrs    r27, 0                  ; a product of normal numbers stays here
5:      rjmp    divide

; ---- A * B ----

multiply:
        bst     r30, 7
        clr     r27
        mov     r26, r25
        add     r26, r21
        adc     r27, r27
        subi    r26, 125
        sbci    r27, 0
        ; r24:r23:r22:r25:r31:r30 = (r24:r23:r22) * (r20:r19:r18)
        mul     r22, r18
        movw    r30, r0
        mul     r22, r19
        add     r31, r0
        clr     r25
        adc     r25, r1
        mul     r22, r20
        add     r25, r0
        clr     r22
        adc     r22, r1
        clr     r21
        mul     r23, r18
        add     r31, r0
        adc     r25, r1
        adc     r22, r21
        mul     r24, r18
        add     r25, r0
        adc     r22, r1
        adc     r21, r21
        clr     r18
        mul     r23, r19
        add     r25, r0
        adc     r22, r1
        adc     r21, r18
        mul     r23, r20
        add     r22, r0
        adc     r21, r1
        adc     r18, r18
        clr     r23
        mul     r24, r19
        add     r22, r0
        adc     r21, r1
        adc     r18, r23
        mul     r24, r20
        add     r21, r0
        adc     r18, r1
        mov     r23, r21
        mov     r24, r18
        clr     r1

; ---- Result ----

; Mantissa r24:r22 and below it r25, r31, r30; exponent - 1 in r27:r26, of any size; sign in T.
normalise:
        tst     r24
        brmi    in_range
1:      sbiw    r26, 1
        brmi    4f
        lsl     r30
        rol     r31
        rol     r25
        rol     r22
        rol     r23
        rol     r24
        brpl    1b
in_range:
        cpi     r26, 254
        cpc     r27, r1
        brlo    round
        sbrs    r27, 7
        rjmp    infinity
3:      or      r31, r25                ; the exponent rises to 1: a subnormal number
        lsr     r24
        ror     r23
        ror     r22
        ror     r25
4:      adiw    r26, 1
        brne    3b
round:
        lsl     r24                     ; the hidden bit makes exponent - 1 the exponent
        adc     r26, r1
        lsr     r26
        ror     r24
        lsl     r25                     ; C: the half
        brcc    sign
        or      r25, r31
        or      r25, r30
        sbrc    r22, 0
        clz
        breq    sign                    ; a tie, and even
        subi    r22, 0xff
        sbci    r23, 0xff
        sbci    r24, 0xff
        sbci    r26, 0xff               ; (the largest number becomes infinity)
sign:   bld     r26, 7
        mov     r25, r26
        ret

; ---- A + B ----

; The same as unpack, here once more: a jump less for what a filter does most.
21:     set                             ; special A
        breq    23f
        clr     r25
        rjmp    23f
22:     set                             ; special B
        breq    24f
        clr     r21
        rjmp    24f

        .global __subsf3
        .type   __subsf3, @function
__subsf3:
        subi    r21, 0x80
        .global __addsf3
        .type   __addsf3, @function
__addsf3:
        clr     r27
        clt
        mov     r31, r25
        mov     r30, r25
        eor     r30, r21
        lsl     r24
        rol     r25
        dec     r25
        cpi     r25, 254                ; C: a normal number's hidden bit
        brsh    21b
23:     ror     r24
        lsl     r20
        rol     r21
        dec     r21
        cpi     r21, 254
        brsh    22b
24:     ror     r20
order:                                  ; A becomes the larger in size
        cp      r22, r18
        cpc     r23, r19
        cpc     r24, r20
        cpc     r25, r21
        brsh    1f
        movw    r0, r22
        movw    r22, r18
        movw    r18, r0
        movw    r0, r24
        movw    r24, r20
        movw    r20, r0
        clr     r1
        eor     r31, r30
1:      brts    special
add:
        bst     r31, 7
        mov     r26, r25
        sub     r25, r21
        clr     r21                     ; below the mantissa of B
        clr     r31                     ; not zero if anything fell out below r21
        ; B >> r25, by bytes and by bits.
2:      cpi     r25, 8
        brlo    5f
        cpi     r25, 26
        brsh    3f
        cp      r1, r21
        sbci    r31, 0
        mov     r21, r18
        mov     r18, r19
        mov     r19, r20
        clr     r20
        subi    r25, 8
        rjmp    2b
4:      lsr     r20
        ror     r19
        ror     r18
        ror     r21
        sbci    r31, 0
5:      dec     r25
        brpl    4b
        clr     r25                     ; below the mantissa of A
        sbrc    r30, 7
        rjmp    6f
        clr     r30
        mov     r25, r21
        add     r22, r18
        adc     r23, r19
        adc     r24, r20
        brcc    7f
        or      r31, r25
        ror     r24
        ror     r23
        ror     r22
        ror     r25
        adiw    r26, 1
        rjmp    in_range
6:      clr     r30
        cp      r1, r31
        sbc     r25, r21
        sbc     r22, r18
        sbc     r23, r19
        sbc     r24, r20
        brmi    7f
        brne    8f
        ret                             ; A - A = +0
3:      lsr     r25                     ; B is below half of A's last place: A stays
7:      rjmp    round
8:      rjmp    normalise

; ---- Zeros, subnormals, infinities, NaN ----

; Sum or product; |A| >= |B|.
special:
        cpi     r25, 254
        breq    1f
        sbrs    r27, 0
        rjmp    add
        cp      r1, r18
        cpc     r1, r19
        cpc     r1, r20
        brcs    multiply_subnormal
        bst     r30, 7
zero:   clr     r24
        clr     r26
        rjmp    4f
1:      or      r22, r23
        or      r22, r24
        brne    nan
        sbrc    r27, 0
        rjmp    2f
        bst     r31, 7
        cpi     r21, 254
        brne    infinity
        sbrc    r30, 7
        rjmp    nan
        rjmp    infinity
2:      bst     r30, 7
        or      r18, r19
        or      r18, r20
        or      r18, r21
        brne    infinity
nan:    ldi     r24, 0xc0
        rjmp    3f
infinity:
        ldi     r24, 0x80
3:      ldi     r26, 0x7f
4:      clr     r23
        clr     r22
        rjmp    sign
multiply_subnormal:
        rjmp    multiply

; Quotient.
divide_special:
        cpi     r25, 254
        breq    3f
        cpi     r21, 254
        breq    4f
        cp      r1, r18
        cpc     r1, r19
        cpc     r1, r20
        sbc     r26, r26                ; bit 7: B is not zero
        cp      r1, r22
        cpc     r1, r23
        cpc     r1, r24
        brcc    2f
        sbrs    r26, 7
1:      rjmp    infinity
        rjmp    divide_normal
2:      sbrs    r26, 7
        rjmp    nan
        rjmp    zero
3:      or      r22, r23                ; infinity / B
        or      r22, r24
        brne    5f
        cpi     r21, 254
        breq    5f
        sbrc    r27, 5
        brts    5f
        rjmp    infinity
4:      or      r18, r19                ; A / infinity
        or      r18, r20
        breq    zero
5:      rjmp    nan

; ---- A / B ----

divide:
        sbrc    r27, 0
        rjmp    order                   ; a special product
        mov     r0, r27                 ; bit 5: root
        bld     r27, 6
        bst     r30, 7
        sbrc    r27, 6
        rjmp    divide_special
divide_normal:
        mov     r26, r25
        sub     r26, r21
        sbc     r27, r27
        subi    r26, lo8(-126)
        sbci    r27, hi8(-126)
1:      tst     r24                     ; subnormal numbers
        brmi    2f
        sbiw    r26, 1
        lsl     r22
        rol     r23
        rol     r24
        rjmp    1b
2:      sbrc    r0, 5
        rjmp    root
3:      tst     r20
        brmi    4f
        adiw    r26, 1
        lsl     r18
        rol     r19
        rol     r20
        rjmp    3b
        ; The remainder is r21:r31:r30, at first A; r20:r18 = B - 1 is less if B is not more. Bits
        ; of the quotient come in at r25, bytes at r22, until the first bit, which is 1, is at its
        ; place.
4:      movw    r30, r22
        mov     r21, r24
        clr     r22
        clr     r23
        ldi     r25, 1
        subi    r18, 1
        sbc     r19, r1
        sbc     r20, r1
        cp      r18, r30
        cpc     r19, r31
        cpc     r20, r21
        brlo    6f
        sbiw    r26, 1
5:      lsl     r30
        rol     r31
        rol     r21
        brcs    6f
        cp      r18, r30
        cpc     r19, r31
        cpc     r20, r21
        brsh    7f
6:      sbc     r30, r18                ; with C: less B
        sbc     r31, r19
        sbc     r21, r20
        sec
7:      rol     r25
        brcc    5b
        mov     r24, r23
        mov     r23, r22
        mov     r22, r25
        ldi     r25, 1
        tst     r24
        brpl    5b
        ; The half: the remainder is more than what B - 1 is above it.
        sub     r18, r30
        sbc     r19, r31
        sbc     r20, r21
        cp      r18, r30
        cpc     r19, r31
        cpc     r20, r21
        sbc     r25, r25
        or      r31, r21
        rjmp    in_range

; ---- Root of A ----

root:
        brts    1f
        clr     r25
        ; Bit by bit. With P, the root so far, and b, the next bit: P + b / 2 in r20:r18 (1 is 0x80
        ; in r20), b and b / 2 in r21:r31:r30, and the remainder by 2 b in r24:r22.
        ldi     r20, 0xa0
        clr     r19
        clr     r18
        ldi     r21, 0x60
        movw    r30, r18
        asr     r27
        ror     r26
        brcs    2f
        subi    r24, 0x80               ; from 1 to 2, less the leading 1
        rjmp    4f
2:      subi    r24, 0x40               ; from 2 to 4, doubled next
3:      lsl     r22
        rol     r23
        rol     r24
        brcs    5f
4:      cp      r22, r18
        cpc     r23, r19
        cpc     r24, r20
        brlo    6f
5:      sub     r22, r18
        sbc     r23, r19
        sbc     r24, r20
        or      r18, r30
        or      r19, r31
        or      r20, r21
6:      lsr     r21
        ror     r31
        ror     r30
        eor     r18, r30
        eor     r19, r31
        eor     r20, r21
        brcc    3b
        ; The last bit and the half, which rounds (a root is no tie): b / 2 is below r18. r21 is 0.
7:      lsl     r22
        rol     r23
        rol     r24
        brcs    8f
        cp      r18, r22
        cpc     r19, r23
        cpc     r20, r24
        brcc    9f
8:      sbc     r22, r18
        sbc     r23, r19
        sbc     r24, r20
        subi    r18, 0xff
        sbci    r19, 0xff
        sbci    r20, 0xff
9:      com     r21
        brne    7b
        movw    r22, r18
        mov     r24, r20
        subi    r26, lo8(-63)
        rjmp    round

1:      rjmp    nan
#endif
