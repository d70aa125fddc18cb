#if defined(__AVR__) && defined(__AVR_HAVE_MUL__) && defined(__AVR_HAVE_JMP_CALL__)

; The row kernels of auvest/math/linear_algebra.hpp for AVR chips with a hardware multiplier: what
; they compute and in which order is said there. avr-gcc takes twice the flash for them.
;
; Arguments and results as avr-gcc has them: the first in r25:r22 (a float) or r25:r24 (a pointer),
; the next below, each from an even register; a count is a byte. Called routines may change r0,
; r18-r27, r30, r31 and T; r1 is zero.

        .text                           ; before .text.*, where gcc puts what is hot

; float plus_dot(float start, const float* u, const float* v, count)   start + sum u v
; float minus_dot(float start, const float* u, const float* v, count)  start - sum u v
; float dot(const float* u, const float* v, count)                     sum u v, count > 0

        .global auvest_dot
        .type   auvest_dot, @function
auvest_dot:
        push    r16
        mov     r16, r20
        dec     r16                     ; one product comes first
        movw    r18, r22
        movw    r20, r24
        set                             ; there is no start
        rjmp    1f

        .global auvest_plus_dot
        .type   auvest_plus_dot, @function
auvest_plus_dot:
        push    r16
        clt
1:      push    r17
        ldi     r17, 0x00
        rjmp    2f

        .global auvest_minus_dot
        .type   auvest_minus_dot, @function
auvest_minus_dot:
        push    r16
        push    r17
        clt
        ldi     r17, 0x80               ; what is flipped in a product: its sign
2:      push    r10
        push    r11
        push    r12
        push    r13
        push    r14
        push    r15
        push    r28
        push    r29
        movw    r28, r20                ; u
        movw    r14, r18                ; v
        brtc    4f
        rcall   product
        rjmp    4f
3:      movw    r10, r22                ; the sum so far
        movw    r12, r24
        rcall   product
        eor     r25, r17
        movw    r18, r10
        movw    r20, r12
        call    __addsf3
4:      subi    r16, 1
        brcc    3b
restore:
        pop     r29
        pop     r28
        pop     r15
        pop     r14
        pop     r13
        pop     r12
        pop     r11
        pop     r10
        pop     r17
        pop     r16
        ret

product:
        ld      r22, Y+
        ld      r23, Y+
        ld      r24, Y+
        ld      r25, Y+
        movw    r30, r14
        ld      r18, Z+
        ld      r19, Z+
        ld      r20, Z+
        ld      r21, Z+
        movw    r14, r30
        jmp     __mulsf3

; void add_scaled(float scale, const float* x, float* y, count)        y += scale x

        .global auvest_add_scaled
        .type   auvest_add_scaled, @function
auvest_add_scaled:
        push    r16
        push    r17
        push    r10
        push    r11
        push    r12
        push    r13
        push    r14
        push    r15
        push    r28
        push    r29
        movw    r10, r22
        movw    r12, r24
        movw    r14, r20                ; x
        movw    r28, r18                ; y
        rjmp    6f
5:      movw    r30, r14
        ld      r18, Z+
        ld      r19, Z+
        ld      r20, Z+
        ld      r21, Z+
        movw    r14, r30
        movw    r22, r10
        movw    r24, r12
        call    __mulsf3
        ld      r18, Y
        ldd     r19, Y+1
        ldd     r20, Y+2
        ldd     r21, Y+3
        call    __addsf3
        st      Y+, r22
        st      Y+, r23
        st      Y+, r24
        st      Y+, r25
6:      subi    r16, 1
        brcc    5b
        rjmp    restore

; bool all_finite(const float* a, count)                               count > 0

        .global auvest_all_finite
        .type   auvest_all_finite, @function
auvest_all_finite:
        movw    r30, r24
7:      ldd     r24, Z+2
        ldd     r25, Z+3
        adiw    r30, 4
        lsl     r24
        rol     r25                     ; the exponent: 255 if the number is not finite
        cpi     r25, 0xff
        ldi     r24, 0
        breq    8f
        dec     r22
        brne    7b
        ldi     r24, 1
8:      ret

#endif
